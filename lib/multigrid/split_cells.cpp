#include "multigrid/split_cells.h"

#include <algorithm>
#include <limits>
#include <map>
#include <unordered_map>

#include "grid/coarse_block.h"
#include "multigrid/firm_sets.h"

namespace vdb_diffuse {
namespace {

constexpr size_t kRowGrain = 64;  ///< rows a thread takes at a time: some ten microseconds of work
constexpr Node kNoParent = std::numeric_limits<Node>::min();  // joined to nothing: the smoother solves it

class Splitter {
 public:
  Splitter(const Operator& fine, Twins& twins, size_t most, Transfer& transfer, Operator& coarse,
           Twins& coarse_twins)
      : fine_(fine), twins_(twins), transfer_(transfer), coarse_(coarse), made_(coarse_twins), most_(most) {
    for (size_t t = 0; t < twins_.size(); ++t) {
      const Coord& p = twins_.place[t];
      const Node block = fine_.topology->find(blockOriginOf(p));
      cell_of_twin_.push_back(cellOf(block * kBlockVoxels + voxelOffset(p[0] & 7, p[1] & 7, p[2] & 7)));
      for (int32_t k = twins_.first[t]; k < twins_.first[t + 1]; ++k)
        if (twins_.links[k].to >= 0)
          twins_of_[twins_.links[k].to].push_back({~static_cast<Node>(t), twins_.links[k].g});
    }
  }

  void run(std::vector<uint64_t> loose) {
    sift(loose);
    gatherCells(loose);
    for (const auto& [cell, members] : cells_) splitCell(cell, members);
    mendSinks();
    mendFaces();
    joinTwins();
    formRows();
  }

 private:
  struct Joint {
    Node to;
    float g;
  };
  const Operator& fine_;
  Twins& twins_;
  Transfer& transfer_;
  Operator& coarse_;
  Twins& made_;
  const size_t most_;
  std::vector<Node> cell_of_twin_;
  std::unordered_map<Node, std::vector<Joint>> twins_of_;  // of the voxels that have links to twins
  std::map<Node, std::vector<Node>> cells_;  // those that need a closer look, with their members
  std::unordered_map<Node, Node> parent_;    // of twins, and of voxels that are not their cell's
  std::vector<Node> strays_;                 // those voxels

  /// Index of the coarse voxel where a node stands.
  Node cellOf(Node node) const {
    if (node < 0) return cell_of_twin_[~node];
    const size_t b = static_cast<size_t>(node) / kBlockVoxels;
    const Coord p = voxelLocal(static_cast<int>(node % kBlockVoxels));
    const Coord o = octantOf(fine_.topology->origin(b));
    return Node{transfer_.parent[b]} * kBlockVoxels +
           voxelOffset(o[0] + p[0] / 2, o[1] + p[1] / 2, o[2] + p[2] / 2);
  }
  Node parentOf(Node node) const {
    const auto found = parent_.find(node);
    return found == parent_.end() ? cellOf(node) : found->second;
  }
  bool strays(Node voxel) const { return parent_.count(voxel) > 0; }

  /// visit(node, conductance) for all that a node is joined to.
  template <typename Visit>
  void forEachJoint(Node node, const Visit& visit) const {
    if (node < 0) {
      for (int32_t k = twins_.first[~node]; k < twins_.first[~node + 1]; ++k)
        visit(twins_.links[k].to, twins_.links[k].g);
      return;
    }
    forEachFace(fine_, node, [&](int, Node next, float g) { visit(next, g); });
    if (twins_of_.empty()) return;
    const auto found = twins_of_.find(node);
    if (found == twins_of_.end()) return;
    for (const Joint& joint : found->second) visit(joint.to, joint.g);
  }

  /// Active voxels of the cell that has `voxel`.
  std::vector<Node> voxelsOfCell(Node voxel) const {
    const size_t b = static_cast<size_t>(voxel) / kBlockVoxels;
    const Coord p = voxelLocal(static_cast<int>(voxel % kBlockVoxels)) & ~1;
    std::vector<Node> voxels;
    for (int u = 0; u < 8; ++u) {
      const int n = voxelOffset(p[0] + (u >> 2), p[1] + (u >> 1 & 1), p[2] + (u & 1));
      if (fine_.topology->active(b).isOn(n)) voxels.push_back(static_cast<Node>(b * kBlockVoxels) + n);
    }
    return voxels;
  }

  static Node firstVoxel(size_t block, int cell) {
    return static_cast<Node>(block * kBlockVoxels) +
           voxelOffset(2 * (cell >> 4), 2 * (cell >> 2 & 3), 2 * (cell & 3));
  }

  /// Leaves the bits of the cells that come apart.
  void sift(std::vector<uint64_t>& loose) const {
    forEachBlock(loose.size(), [&](size_t b) {
      FirmSets sets;
      for (uint64_t cells = loose[b]; cells; cells &= cells - 1) {
        const int c = __builtin_ctzll(cells);
        joinFirmSets(voxelsOfCell(firstVoxel(b, c)), sets);
        if (sets.count() == 1) loose[b] &= ~(uint64_t{1} << c);
      }
    });
  }

  void gatherCells(const std::vector<uint64_t>& split) {
    size_t apart = 0;
    for (const uint64_t cells : split) apart += __builtin_popcountll(cells);
    for (size_t b = 0; b < split.size() && apart <= most_; ++b)
      for (uint64_t cells = split[b]; cells; cells &= cells - 1) {
        const Node voxel = firstVoxel(b, __builtin_ctzll(cells));
        cells_[cellOf(voxel)] = voxelsOfCell(voxel);
      }
    for (size_t t = 0; t < twins_.size(); ++t) {
      const Coord& p = twins_.place[t];
      const Node voxel = Node{fine_.topology->find(blockOriginOf(p))} * kBlockVoxels +
                         voxelOffset(p[0] & 7, p[1] & 7, p[2] & 7);
      auto& members = cells_[cell_of_twin_[t]];
      if (members.empty()) members = voxelsOfCell(voxel);
      members.push_back(~static_cast<Node>(t));
    }
  }

  void joinFirmSets(const std::vector<Node>& members, FirmSets& sets) const {
    sets.reset(members.size());
    for (size_t i = 0; i < members.size(); ++i)
      forEachJoint(members[i], [&](Node to, float g) {
        const auto found = std::find(members.begin(), members.end(), to);
        if (found == members.end())
          sets.tieOut(i, g);
        else
          sets.tie(i, static_cast<size_t>(found - members.begin()), g);
      });
    sets.join();
  }

  /// The largest of a cell's sets keeps its voxel; each other gets a twin.
  void splitCell(Node cell, const std::vector<Node>& members) {
    FirmSets sets;
    joinFirmSets(members, sets);
    const std::vector<int>& set = sets.setOf();
    std::vector<char> joined(members.size(), 0);
    for (size_t i = 0; i < members.size(); ++i) forEachJoint(members[i], [&](Node, float) { joined[i] = 1; });
    int largest = -1, most = 0;
    for (size_t i = 0; i < set.size(); ++i) {
      const int size = joined[i] ? static_cast<int>(std::count(set.begin(), set.end(), set[i])) : 0;
      if (size > most || largest < 0) {
        largest = set[i];
        most = size;
      }
    }
    std::map<int, Node> twin_of_set;
    for (size_t i = 0; i < members.size(); ++i) {
      const Node node = members[i];
      if (set[i] == largest) {
        if (node < 0) parent_[node] = cell;
        continue;
      }
      if (!joined[i]) {
        parent_[node] = kNoParent;
      } else {
        auto found = twin_of_set.find(set[i]);
        if (found == twin_of_set.end()) found = twin_of_set.emplace(set[i], newTwin(cell)).first;
        if (found->second >= 0 && node >= 0) continue;  // shares the cell's voxel after all
        parent_[node] = found->second;
      }
      if (node >= 0) strays_.push_back(node);
    }
  }

  Coord placeOf(Node coarse_voxel) const {
    return coarse_.topology->origin(static_cast<size_t>(coarse_voxel) / kBlockVoxels) +
           voxelLocal(static_cast<int>(coarse_voxel % kBlockVoxels));
  }

  Node newTwin(Node cell) {
    if (made_.size() >= most_) return cell;
    made_.place.push_back(placeOf(cell));
    return ~static_cast<Node>(made_.size() - 1);
  }

  void mendSinks() {
    made_.sink.assign(made_.size(), 0);
    for (const auto& [cell, members] : cells_) {
      coarse_.sink[cell] = 0;
      for (const Node node : members) {
        const Node parent = parentOf(node);
        if (parent == kNoParent) continue;
        const float sink = node < 0 ? twins_.sink[~node] : fine_.sink[node];
        (parent < 0 ? made_.sink[~parent] : coarse_.sink[parent]) += sink;
      }
    }
  }

  /// Coarse faces to which strays had added.
  void mendFaces() {
    for (const Node stray : strays_)
      forEachFace(fine_, stray, [&](int face, Node next, float) {
        if (cellOf(next) == cellOf(stray)) return;
        const int axis = face / 2;
        const Node upper = face % 2 ? next : stray;
        float sum = 0;
        const int side = static_cast<int>(upper >> (6 - 3 * axis) & 1);  // 0: the cell's lower plane
        for (const Node voxel : voxelsOfCell(upper)) {
          if ((voxel >> (6 - 3 * axis) & 1) != side || strays(voxel)) continue;
          forEachFace(fine_, voxel, [&](int other, Node below, float g) {
            if (other == 2 * axis && !strays(below)) sum += g;
          });
        }
        coarse_.faces[axis][cellOf(upper)] = kTwiceAsFar * sum;
      });
  }

  /// Between two cells the way is twice as long as it was, within one it is not.
  float longer(Node a, Node b) const { return cellOf(a) == cellOf(b) ? 1.0f : kTwiceAsFar; }

  void joinTwins() {
    std::map<std::pair<Node, Node>, float> joints;
    const auto join = [&](Node a, Node b, float g) {
      if (!(g > 0)) return;  // less than a float can hold
      joints[{a, b}] += g;
      joints[{b, a}] += g;
    };
    for (const Node stray : strays_) {
      const Node parent = parentOf(stray);
      if (parent == kNoParent) continue;
      forEachFace(fine_, stray, [&](int, Node next, float g) {
        if (parentOf(next) == parent || (strays(next) && next < stray)) return;
        join(parent, parentOf(next), longer(stray, next) * g);
      });
    }
    for (size_t t = 0; t < twins_.size(); ++t) {
      const Node node = ~static_cast<Node>(t), parent = parentOf(node);
      for (int32_t k = twins_.first[t]; k < twins_.first[t + 1]; ++k) {
        const Twins::Link& link = twins_.links[k];
        if (link.to < node) continue;  // between twins once
        const Node other = parentOf(link.to);
        if (parent == other) continue;
        if (parent < 0 || other < 0)
          join(parent, other, longer(node, link.to) * link.g);
        else
          joinVoxels(parent, other, kTwiceAsFar * link.g);
      }
    }
    made_.first.assign(1, 0);
    std::vector<std::vector<Twins::Link>> of_twin(made_.size());
    for (const auto& [pair, g] : joints)
      if (pair.first < 0) of_twin[~pair.first].push_back({pair.second, g});
    made_.inverse.clear();
    for (size_t t = 0; t < made_.size(); ++t) {
      double diagonal = made_.sink[t];
      for (const Twins::Link& link : of_twin[t]) {
        made_.links.push_back(link);
        diagonal += link.g;
      }
      made_.first.push_back(static_cast<int32_t>(made_.links.size()));
      constexpr double kLeast = std::numeric_limits<float>::min();  // whose inverse a float can hold too
      made_.inverse.push_back(diagonal > kLeast ? static_cast<float>(1 / diagonal) : 0);
    }
    made_.x.assign(made_.size(), 0);
    made_.b.assign(made_.size(), 0);
  }

  /// A way through a twin that has become one between voxels of the grid.
  void joinVoxels(Node a, Node b, float g) {
    const Coord step = placeOf(b) - placeOf(a);
    for (int axis = 0; axis < 3; ++axis)
      if (step[axis] != 0) coarse_.faces[axis][step[axis] > 0 ? b : a] += g;
  }

  void formRows() {
    std::vector<Node> nodes = strays_;
    for (const Node stray : strays_)
      forEachFace(fine_, stray, [&](int, Node next, float) { nodes.push_back(next); });
    for (const auto& [voxel, joints] : twins_of_) nodes.push_back(voxel);
    for (size_t t = 0; t < twins_.size(); ++t)
      if (parentOf(~static_cast<Node>(t)) != kNoParent) nodes.push_back(~static_cast<Node>(t));
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());

    std::vector<std::vector<Interpolation::Weight>> weights(nodes.size());
    forEachBlock(
        nodes.size(), [&](size_t row) { weights[row] = weightsOf(nodes[row]); }, kRowGrain);
    Interpolation& rows = transfer_.apart;
    for (const std::vector<Interpolation::Weight>& of_row : weights) {
      rows.weights.insert(rows.weights.end(), of_row.begin(), of_row.end());
      rows.first.push_back(static_cast<int32_t>(rows.weights.size()));
    }
    rows.fine = std::move(nodes);
    for (Twins::Link& link : twins_.links)
      if (link.to >= 0)
        link.row = static_cast<int32_t>(std::lower_bound(rows.fine.begin(), rows.fine.end(), link.to) -
                                        rows.fine.begin());
  }

  std::vector<Interpolation::Weight> weightsOf(Node node) const {
    std::vector<Interpolation::Weight> weights;
    const auto weigh = [&](Node coarse, float own, float blocks) {
      if (coarse == kNoParent) return;
      for (Interpolation::Weight& weight : weights)
        if (weight.coarse == coarse) {
          weight.own += own;
          weight.blocks += blocks;
          return;
        }
      weights.push_back({coarse, own, blocks});
    };
    // As outerWeights of block_transfer.h has it, with all that the node is joined to.
    interpolate(
        [&](const auto& visit) { forEachJoint(node, [&](Node to, float g) { visit(parentOf(to), g); }); },
        parentOf(node), [&](Node coarse, float w) { weigh(coarse, w, 0); });
    if (node >= 0)
      interpolate(
          [&](const auto& visit) {
            forEachFace(fine_, node, [&](int, Node to, float g) { visit(cellOf(to), g); });
          },
          cellOf(node), [&](Node coarse, float w) { weigh(coarse, 0, w); });
    return weights;
  }

  /// weigh(coarse unknown, weight), given visit(coarse unknown, conductance) of each joint.
  template <typename ForEach, typename Weigh>
  static void interpolate(const ForEach& forEach, Node parent, const Weigh& weigh) {
    float sum = 0, outer = 0;
    forEach([&](Node coarse, float g) {
      sum += g;
      if (coarse != parent) outer += g;
    });
    const float most = std::max(sum / kLinear, outer / (1 - kParentAtLeast));
    const float scale = most > 0 ? 1 / most : 0;
    weigh(parent, 1 - scale * outer);
    forEach([&](Node coarse, float g) {
      if (coarse != parent) weigh(coarse, scale * g);
    });
  }
};

}  // namespace

void splitCells(const Operator& fine, Twins& twins, std::vector<uint64_t> loose, size_t most,
                Transfer& transfer, Operator& coarse, Twins& coarse_twins) {
  Splitter(fine, twins, most, transfer, coarse, coarse_twins).run(std::move(loose));
}

}  // namespace vdb_diffuse
