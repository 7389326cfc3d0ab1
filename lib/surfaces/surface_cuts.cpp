#include "surfaces/surface_cuts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace vdb_diffuse {
namespace {

constexpr uint32_t kBehind = ~0u;  // in place of a block
/// Steps to either side of the place where a ray meets a surface that are asked where their voxels lie.
/// Centres lie at most 0.87 voxels off the ray, so that more steps are in doubt only where it grazes the
/// surface.
constexpr int kDoubtful = 16;
/// Surfaces that a ray meets within one layer, at most, and the last one.
constexpr size_t kMostInLayer = 8;

/// A step of a ray on its way through the layers.
struct Place {
  int layer, step;
  bool operator<(const Place& o) const { return std::tie(layer, step) < std::tie(o.layer, o.step); }
};

struct FoundCut {
  uint32_t block, step, ray, order;  ///< order along the ray
  uint32_t slot;
  bool operator<(const FoundCut& o) const {
    return std::tie(block, step, ray, order) < std::tie(o.block, o.step, o.ray, o.order);
  }
};

/// A place where a ray meets a surface.
struct Meeting {
  Occluder::Hit hit;
  double t;  ///< in layers from the ray's start
  Vec3d p_index;
};

/// Finds the cuts of one direction.
class Finder {
 public:
  Finder(const Topology& topology, const RayLattice& lattice, const Transform& transform,
         const Occluder& occluder, const CellTree& tree)
      : topology_(topology), lattice_(lattice), transform_(transform), occluder_(occluder), tree_(tree) {
    layers_ = static_cast<int>(lattice.layers.size());
    const Vec3d along = transform.directionToWorld(lattice.along);
    layer_length_ = along.length();
    direction_ = along / layer_length_;
    least_step_ = 1e-6 * transform.meanVoxelSize() +
                  1e-9 * (occluder.highest() - occluder.lowest()).length();  // off a surface just met
  }

  void run() {
    findBlocks();
    for (int i = 0; i < lattice_.rows; ++i)
      for (int j = 0; j < lattice_.pitch; ++j) {
        const size_t ray = static_cast<size_t>(i) * lattice_.pitch + j;
        if (first_[ray] <= last_[ray])
          follow(static_cast<uint32_t>(ray), i + lattice_.first_u, j + lattice_.first_v);
      }
    first_ = last_ = {};
    numbers_.clear();
    std::sort(cuts.begin(), cuts.end());
  }

  std::vector<FoundCut> cuts;
  std::vector<CellKey> keys;  ///< of the cells, by number
  SurfaceCuts::Ends ends;     ///< of the slots, cells by number

 private:
  const Topology& topology_;
  const RayLattice& lattice_;
  const Transform& transform_;
  const Occluder& occluder_;
  const CellTree& tree_;
  int layers_;
  double layer_length_, least_step_;
  Vec3d direction_;
  std::vector<int> first_, last_;  // steps in a block, by ray
  std::unordered_map<CellKey, uint32_t, CellHash> numbers_;
  std::vector<Meeting> meetings_;
  std::vector<int> turns_;
  Coord looked_up_{Coord::max()};
  int32_t block_ = kNoBlock;

  /// The first and the last step of every ray that lies in a block.
  void findBlocks() {
    first_.assign(lattice_.rays(), std::numeric_limits<int>::max());
    last_.assign(lattice_.rays(), -1);
    for (size_t b = 0; b < topology_.blockCount(); ++b) {
      const Coord& origin = topology_.origin(b);
      for (int w = 0; w < kBlockWidth; ++w) {
        const int at = origin[lattice_.w] + w - lattice_.first_layer;
        const Layer& layer = lattice_.layers[at];
        for (int k = 0; k < layer.steps; ++k) {
          const int number = numberOf({lattice_.sign > 0 ? at : layers_ - 1 - at, k});
          for (int u = 0; u < kBlockWidth; ++u) {
            const size_t ray = lattice_.place(origin[lattice_.u] + u - layer.step[k].shift_u,
                                              origin[lattice_.v] - layer.step[k].shift_v);
            for (int v = 0; v < kBlockWidth; ++v) {
              first_[ray + v] = std::min(first_[ray + v], number);
              last_[ray + v] = std::max(last_[ray + v], number);
            }
          }
        }
      }
    }
  }
  /// Steps of the whole way by number; a layer of fewer leaves some numbers out.
  static int numberOf(Place at) { return kMostSteps * at.layer + at.step; }
  static Place placeOf(int number) { return {number / kMostSteps, number % kMostSteps}; }

  Coord voxelAt(int i, int j, Place at) const {
    const LayerStep& step = lattice_.layerOnTheWay(at.layer).step[at.step];
    Coord p;
    p[lattice_.w] = lattice_.layerCoordinate(at.layer);
    p[lattice_.u] = i + step.shift_u;
    p[lattice_.v] = j + step.shift_v;
    return p;
  }
  bool onward(Place& at) const {
    if (++at.step < lattice_.layerOnTheWay(at.layer).steps) return true;
    at = {at.layer + 1, 0};
    return at.layer < layers_;
  }
  bool back(Place& at) const {
    if (--at.step >= 0) return true;
    if (--at.layer < 0) return false;
    at.step = lattice_.layerOnTheWay(at.layer).steps - 1;
    return true;
  }
  int32_t blockAt(int i, int j, Place at) {
    const Coord origin = blockOriginOf(voxelAt(i, j, at));
    if (origin != looked_up_) {
      looked_up_ = origin;
      block_ = topology_.find(origin);
    }
    return block_;
  }
  /// The step that passes t, in layers from the ray's start; 0 <= t < layers.
  Place stepAt(double t) const {
    Place at{std::min(static_cast<int>(t), layers_ - 1), 0};
    const Layer& layer = lattice_.layerOnTheWay(at.layer);
    double rest = t - at.layer;
    while (at.step + 1 < layer.steps && rest >= layer.step[at.step].extent)
      rest -= layer.step[at.step++].extent;
    return at;
  }

  /// Asks whether a step's voxel has its centre behind the surface, seen along the ray.
  auto behind(const Meeting& at, int i, int j) const {
    const Mesh& mesh = tree_.surfaces()[at.hit.surface].mesh;
    const auto& corner = mesh.triangles[at.hit.triangle];
    const Vec3d &a = mesh.positions[corner[0]], &b = mesh.positions[corner[1]],
                &c = mesh.positions[corner[2]];
    const Vec3d normal = (b - a).cross(c - a) * (at.hit.front ? -1.0 : 1.0);
    const Vec3d per_voxel(normal.dot(transform_.axis(0)), normal.dot(transform_.axis(1)),
                          normal.dot(transform_.axis(2)));
    return [this, per_voxel, i, j, met = at.p_index](Place p) {
      return per_voxel.dot(voxelAt(i, j, p).asVec3d() - met) > 0;
    };
  }

  uint32_t cellOf(const Occluder::Hit& hit, bool front, const Vec3d& p_index) {
    if (tree_.surfaces()[hit.surface].albedo.isZero()) return SurfaceCuts::kNoCell;
    const CellKey key = tree_.keyOf(hit.surface, hit.triangle, front, p_index);
    const auto [at, added] = numbers_.emplace(key, static_cast<uint32_t>(keys.size()));
    if (added) keys.push_back(key);
    return at->second;
  }

  /// The last surface before the ray's blocks, and all from there on up to the first behind them; of piles
  /// the first ones and the last.
  void meetSurfaces(const Vec3d& start, int first, int last) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    meetings_.clear();
    const double t_start = std::max(0, placeOf(first).layer - kDoubtful);
    const Vec3d origin = transform_.toWorld(start + lattice_.along * t_start);
    if (auto hit = occluder_.closest(origin, -direction_, kFar)) {
      hit->front = !hit->front;  // seen along the light
      addMeeting(*hit, start, t_start - hit->distance / layer_length_);
    }
    double travelled = 0, step = least_step_;
    while (const auto hit = occluder_.closest(origin + direction_ * travelled, direction_, kFar)) {
      const double distance = travelled + hit->distance;
      travelled = distance + step;
      // A ray that starts at a surface may meet it again, or its neighbour across an edge.
      if (!meetings_.empty()) {
        const Occluder::Hit& before = meetings_.back().hit;
        if (hit->surface == before.surface && hit->front == before.front &&
            (hit->triangle == before.triangle ||
             distance - (meetings_.back().t - t_start) * layer_length_ < 4 * least_step_)) {
          step *= 2;
          continue;
        }
      }
      step = least_step_;
      const double t = t_start + distance / layer_length_;
      addMeeting(*hit, start, t);
      if (t >= layers_ || numberOf(stepAt(t)) > last + kMostSteps * kDoubtful) return;
      travelled = pastPile(start, origin, t_start, travelled);
    }
  }
  /// Where more than kMostInLayer surfaces follow each other within a layer, light goes through none of them,
  /// and from the last one it leaves: those between are not asked for. How far the ray has come then.
  double pastPile(const Vec3d& start, const Vec3d& origin, double t_start, double travelled) {
    if (meetings_.size() <= kMostInLayer) return travelled;
    const double end = (meetings_[meetings_.size() - 1 - kMostInLayer].t + 1 - t_start) * layer_length_;
    if (end <= travelled) return travelled;
    if (auto hit = occluder_.closest(origin + direction_ * end, -direction_, end - travelled)) {
      hit->front = !hit->front;  // seen along the light
      addMeeting(*hit, start, t_start + (end - hit->distance) / layer_length_);
    }
    return end;
  }
  void addMeeting(const Occluder::Hit& hit, const Vec3d& start, double t) {
    meetings_.push_back({hit, t, start + lattice_.along * t});
  }

  /// The steps before which the light of a ray and that of the surface's other side change places. There is
  /// one where the ray meets the surface; where it slants through, voxels of either side may follow each
  /// other by turns. \param first, end  steps that may be asked
  void findTurns(const Meeting& at, int i, int j, int first, int end) {
    turns_.clear();
    Place p = at.t < 0 ? Place{0, 0} : at.t < layers_ ? stepAt(at.t) : Place{layers_, 0};
    const int met = std::max(numberOf(p), first);
    for (int n = 0; n < kDoubtful; ++n) {
      Place q = p;
      if (!back(q) || numberOf(q) < first) break;
      p = q;
    }
    const auto isBehind = behind(at, i, j);
    bool beyond = false;
    for (int n = 0; n <= 2 * kDoubtful && p.layer < layers_ && numberOf(p) < end; ++n) {
      if (isBehind(p) != beyond) {
        turns_.push_back(numberOf(p));
        beyond = !beyond;
      }
      onward(p);
    }
    if (!beyond) turns_.push_back(turns_.empty() ? met : std::max(met, std::min(numberOf(p), end)));
  }

  void cut(uint32_t ray, int i, int j, int turn, uint32_t order) {
    const uint32_t slot = static_cast<uint32_t>(ends.leaves.size()) - 1;
    if (turn > last_[ray]) {
      cuts.push_back({kBehind, 0, ray, order, slot});
      return;
    }
    Place at = placeOf(std::max(turn, first_[ray]));
    if (at.step >= lattice_.layerOnTheWay(at.layer).steps) at = {at.layer + 1, 0};
    while (blockAt(i, j, at) == kNoBlock) onward(at);
    cuts.push_back({static_cast<uint32_t>(block_), numberInBlock(at), ray, order, slot});
  }

  void follow(uint32_t ray, int i, int j) {
    Vec3d start = lattice_.start;
    start[lattice_.u] += i;
    start[lattice_.v] += j;
    uint32_t order = 0;
    const size_t cuts_before = cuts.size(), slots_before = ends.leaves.size();
    const auto addSlot = [&](uint32_t arrives, uint32_t leaves) {
      ends.arrives.push_back(arrives);
      ends.leaves.push_back(leaves);
    };
    meetSurfaces(start, first_[ray], last_[ray]);
    int from = 0;
    for (size_t m = 0; m < meetings_.size(); ++m) {
      const Meeting& at = meetings_[m];
      int end = kMostSteps * layers_;
      if (m + 1 < meetings_.size()) {
        const double middle = 0.5 * (at.t + meetings_[m + 1].t);
        if (middle < layers_) end = std::max(from, middle < 0 ? 0 : numberOf(stepAt(middle)) + 1);
      }
      findTurns(at, i, j, from, end);
      from = end;
      const bool before = turns_.back() <= first_[ray], ahead = turns_.front() > last_[ray];
      if (before) {  // what light came from earlier surfaces falls on this one, as far as rays know
        cuts.resize(cuts_before);
        ends.arrives.resize(slots_before);
        ends.leaves.resize(slots_before);
        turns_ = {turns_.back()};
      }
      addSlot(before ? SurfaceCuts::kNoCell : cellOf(at.hit, at.hit.front, at.p_index),
              ahead ? SurfaceCuts::kNoCell : cellOf(at.hit, !at.hit.front, at.p_index));
      for (int turn : turns_) cut(ray, i, j, turn, order++);
      if (turns_.back() > last_[ray]) return;
    }
  }

  /// A step's number in its block.
  uint32_t numberInBlock(Place at) const {
    const int w = lattice_.layerCoordinate(at.layer) & (kBlockWidth - 1);
    return static_cast<uint32_t>(kMostSteps * (lattice_.sign > 0 ? w : kBlockWidth - 1 - w) + at.step);
  }
};

}  // namespace

SurfaceCuts findSurfaceCuts(const Wavefront& wavefront, const Transform& transform, const Occluder& occluder,
                            const std::vector<Surface>& surfaces) {
  SurfaceCuts result;
  const Topology& topology = wavefront.topology();
  if (occluder.empty() || topology.blockCount() == 0) return result;
  const CellTree tree(topology, transform, surfaces);
  struct Work {
    int octant;
    size_t direction;
    Finder finder;
  };
  std::vector<Work> work;
  for (int octant = 0; octant < Wavefront::kOctants; ++octant) {
    const std::vector<RayLattice>& lattices = wavefront.lattices(octant);
    result.cuts[octant].resize(lattices.size());
    result.ends[octant].resize(lattices.size());
    for (size_t d = 0; d < lattices.size(); ++d)
      work.push_back({octant, d, Finder(topology, lattices[d], transform, occluder, tree)});
  }
  forEachBlock(
      work.size(), [&](size_t n) { work[n].finder.run(); }, 1);

  std::vector<CellKey> keys;
  for (const Work& w : work) keys.insert(keys.end(), w.finder.keys.begin(), w.finder.keys.end());
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  forEachBlock(
      work.size(),
      [&](size_t n) {
        Finder& finder = work[n].finder;
        if (finder.cuts.empty()) return;
        std::vector<uint32_t> number;
        for (const CellKey& key : finder.keys)
          number.push_back(
              static_cast<uint32_t>(std::lower_bound(keys.begin(), keys.end(), key) - keys.begin()));
        SurfaceCuts::Ends& ends = result.ends[work[n].octant][work[n].direction];
        ends = std::move(finder.ends);
        for (std::vector<uint32_t>* side : {&ends.arrives, &ends.leaves})
          for (uint32_t& cell : *side)
            if (cell != SurfaceCuts::kNoCell) cell = number[cell];
        DirectionCuts& cuts = result.cuts[work[n].octant][work[n].direction];
        cuts.first.assign(topology.blockCount() + 2, 0);
        for (const FoundCut& cut : finder.cuts) {
          cuts.cuts.push_back({cut.ray, cut.slot, static_cast<uint8_t>(cut.step)});
          ++cuts.first[cut.block == kBehind ? topology.blockCount() + 1 : cut.block + 1];
        }
        std::partial_sum(cuts.first.begin(), cuts.first.end(), cuts.first.begin());
        finder.cuts = {};
        finder.keys = {};
      },
      1);
  result.cells = makeSurfaceCells(tree, std::move(keys));
  return result;
}

}  // namespace vdb_diffuse
