#include "multigrid/pieces.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <unordered_map>
#include <unordered_set>

namespace vdb_diffuse {
namespace {

/// A block's mask as eight slices of x, each with y in its bytes and z in its bits.
using Slices = std::array<uint64_t, 8>;
constexpr uint64_t kLowZ = 0x0101010101010101ull;

Slices slicesOf(const BlockMask& mask) {
  Slices s;
  for (int x = 0; x < 8; ++x) s[x] = mask.getWord<uint64_t>(x);
  return s;
}

BlockMask maskOf(const Slices& s) {
  BlockMask mask;
  for (int x = 0; x < 8; ++x) mask.getWord<uint64_t>(x) = s[x];
  return mask;
}

bool any(const Slices& s) {
  uint64_t all = 0;
  for (const uint64_t word : s) all |= word;
  return all != 0;
}

/// Which voxels of a block may be left through each face; all, where nothing is cut.
struct Doors {
  std::array<Slices, 6> open;
  Doors(const Operator& A, size_t b) {
    const auto cuts = A.cuts.find(static_cast<int32_t>(b));
    for (int face = 0; face < 6; ++face)
      for (int x = 0; x < 8; ++x)
        open[face][x] = cuts == A.cuts.end() ? ~uint64_t{0} : ~cuts->second.cut[face].getWord<uint64_t>(x);
  }
};

/// The voxels of `inside` that can be reached from `seed` within the block. What a slice gains is passed on
/// at once, up and then down, so that a few rounds do.
Slices flood(Slices seed, const Slices& inside, const Doors& doors) {
  const auto& open = doors.open;
  const auto grow = [&](int x) {
    uint64_t s = seed[x];
    if (x > 0) s |= seed[x - 1] & open[Topology::kPlusX][x - 1];
    if (x < 7) s |= seed[x + 1] & open[Topology::kMinusX][x + 1];
    s &= inside[x];
    for (uint64_t before = 0; s != before;) {
      before = s;
      s |= (s & open[Topology::kPlusZ][x] & ~(kLowZ << 7)) << 1 |
           (s & open[Topology::kMinusZ][x] & ~kLowZ) >> 1;
      s &= inside[x];
      s |= (s & open[Topology::kPlusY][x]) << 8 | (s & open[Topology::kMinusY][x]) >> 8;
      s &= inside[x];
    }
    const bool grown = s != seed[x];
    seed[x] = s;
    return grown;
  };
  for (bool grown = true; grown;) {
    grown = false;
    for (int x = 0; x < 8; ++x) grown |= grow(x);
    for (int x = 7; x >= 0; --x) grown |= grow(x);
  }
  return seed;
}

/// Connected sets of one block.
std::vector<Slices> fragmentsOf(const Operator& A, size_t b) {
  Slices left = slicesOf(A.topology->active(b));
  const Doors doors(A, b);
  std::vector<Slices> fragments;
  while (any(left)) {
    Slices seed{};
    for (int x = 0; x < 8; ++x)
      if (left[x]) {
        seed[x] = left[x] & (~left[x] + 1);  // its lowest bit
        break;
      }
    fragments.push_back(flood(seed, left, doors));
    for (int x = 0; x < 8; ++x) left[x] &= ~fragments.back()[x];
  }
  return fragments;
}

/// Does a fragment touch one of the next block above it along an axis?
bool touch(const Slices& low, const Slices& high, int axis, const Doors& doors) {
  uint64_t meet = 0;
  if (axis == 0) return (low[7] & doors.open[Topology::kPlusX][7] & high[0]) != 0;
  for (int x = 0; x < 8; ++x) {
    const uint64_t out = low[x] & doors.open[2 * axis + 1][x];
    meet |= axis == 1 ? (out >> 56) & high[x] & 0xff : (out >> 7) & high[x] & kLowZ;
  }
  return meet != 0;
}

struct UnionFind {
  std::vector<int32_t> parent;
  explicit UnionFind(size_t n) : parent(n) { std::iota(parent.begin(), parent.end(), 0); }
  int32_t find(int32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  }
  void join(int32_t i, int32_t j) {
    i = find(i);
    j = find(j);
    parent[std::max(i, j)] = std::min(i, j);
  }
};

struct Piece {
  int64_t voxels = 0;
  Coord lowest = Coord::max(), highest = Coord::min();
  int32_t layer = 0, fragments = 0;
  void add(const Slices& fragment, const Coord& origin) {
    int x_low = 8, x_high = -1;
    uint64_t flat = 0;
    for (int x = 0; x < 8; ++x) {
      if (!fragment[x]) continue;
      x_low = std::min(x_low, x);
      x_high = x;
      flat |= fragment[x];
      voxels += __builtin_popcountll(fragment[x]);
    }
    uint64_t row = flat;
    for (const int shift : {32, 16, 8}) row |= row >> shift;
    row &= 0xff;
    lowest.minComponent(origin + Coord(x_low, __builtin_ctzll(flat) / 8, __builtin_ctzll(row)));
    highest.maxComponent(origin + Coord(x_high, (63 - __builtin_clzll(flat)) / 8, 63 - __builtin_clzll(row)));
  }
  /// The level on whose grid it is one or two voxels wide.
  int level() const {
    int64_t extent = 1;
    for (int a = 0; a < 3; ++a) extent = std::max<int64_t>(extent, int64_t(highest[a]) - lowest[a] + 1);
    int l = 0;
    while ((int64_t{1} << l) < extent) ++l;
    return l;
  }
};

/// Cells that the pieces of one layer take, each on the grid of its own level.
class Layer {
 public:
  bool accepts(const Piece& piece) const {
    for (const auto& [level, cells] : cells_) {
      if (level < piece.level()) continue;
      bool met = false;
      forEachCell(piece, level, [&](const Coord& cell) { met = met || cells.count(cell) > 0; });
      if (met) return false;
    }
    return true;
  }
  void add(const Piece& piece) {
    auto& cells = cells_[piece.level()];
    forEachCell(piece, piece.level(), [&](const Coord& cell) { cells.insert(cell); });
  }

 private:
  struct HashCoord {
    size_t operator()(const Coord& c) const { return c.hash<20>(); }
  };
  std::unordered_map<int, std::unordered_set<Coord, HashCoord>> cells_;

  template <typename Visit>
  static void forEachCell(const Piece& piece, int level, const Visit& visit) {
    for (int x = piece.lowest[0] >> level; x <= piece.highest[0] >> level; ++x)
      for (int y = piece.lowest[1] >> level; y <= piece.highest[1] >> level; ++y)
        for (int z = piece.lowest[2] >> level; z <= piece.highest[2] >> level; ++z) visit(Coord(x, y, z));
  }
};

constexpr int kMostLayers = 32;
// Parts beyond one for each block, as a share of the blocks: each may add a block to the next level.
constexpr double kMostExtraParts = 0.25;

/// Gives each piece its layer. Large pieces choose first, so that a layer's cells only ever get smaller.
int32_t assignLayers(std::vector<Piece>& pieces, size_t block_count) {
  std::vector<int32_t> order(pieces.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int32_t a, int32_t b) {
    const int la = pieces[a].level(), lb = pieces[b].level();
    if (la != lb) return la > lb;
    return pieces[a].voxels != pieces[b].voxels ? pieces[a].voxels > pieces[b].voxels : a < b;
  });
  std::vector<Layer> layers(1);
  double extra = kMostExtraParts * static_cast<double>(block_count) + 64;
  for (const int32_t p : order) {
    Piece& piece = pieces[p];
    if (piece.voxels < 2) continue;
    size_t layer = 0;
    while (layer < layers.size() && !layers[layer].accepts(piece)) ++layer;
    if (layer >= kMostLayers || (layer > 0 && extra < piece.fragments)) continue;
    if (layer == layers.size()) layers.emplace_back();
    layers[layer].add(piece);
    piece.layer = static_cast<int32_t>(layer);
    if (layer > 0) extra -= piece.fragments;
  }
  return static_cast<int32_t>(layers.size());
}

}  // namespace

Parts wholeBlocks(const Topology& topology) {
  Parts parts;
  parts.first.resize(topology.blockCount() + 1);
  std::iota(parts.first.begin(), parts.first.end(), 0);
  for (size_t b = 0; b < topology.blockCount(); ++b) parts.parts.push_back({static_cast<int32_t>(b), 0, -1});
  return parts;
}

Parts separatePieces(const Operator& A) {
  const Topology& topology = *A.topology;
  const size_t blocks = topology.blockCount();
  std::vector<std::vector<Slices>> fragments(blocks);
  forEachBlock(blocks, [&](size_t b) { fragments[b] = fragmentsOf(A, b); });
  std::vector<int32_t> first(blocks + 1, 0);
  for (size_t b = 0; b < blocks; ++b) first[b + 1] = first[b] + static_cast<int32_t>(fragments[b].size());

  UnionFind sets(first[blocks]);
  for (size_t b = 0; b < blocks; ++b) {
    const Doors doors(A, b);
    for (int axis = 0; axis < 3; ++axis) {
      const int32_t near = topology.neighbours(b)[2 * axis + 1];
      if (near == kNoBlock) continue;
      for (size_t i = 0; i < fragments[b].size(); ++i)
        for (size_t j = 0; j < fragments[near].size(); ++j)
          if (touch(fragments[b][i], fragments[near][j], axis, doors))
            sets.join(first[b] + static_cast<int32_t>(i), first[near] + static_cast<int32_t>(j));
    }
  }

  std::vector<int32_t> piece_of(first[blocks], -1);
  std::vector<Piece> pieces;
  for (size_t b = 0; b < blocks; ++b)
    for (size_t i = 0; i < fragments[b].size(); ++i) {
      const int32_t f = first[b] + static_cast<int32_t>(i), root = sets.find(f);
      if (piece_of[root] < 0) {
        piece_of[root] = static_cast<int32_t>(pieces.size());
        pieces.emplace_back();
      }
      Piece& piece = pieces[piece_of[f] = piece_of[root]];
      ++piece.fragments;
      piece.add(fragments[b][i], topology.origin(b));
    }
  if (pieces.size() < 2) return wholeBlocks(topology);

  Parts result;
  result.layers = assignLayers(pieces, blocks);
  if (result.layers == 1) return wholeBlocks(topology);
  result.first.push_back(0);
  for (size_t b = 0; b < blocks; ++b) {
    std::vector<std::pair<int32_t, Slices>> by_layer;
    for (size_t i = 0; i < fragments[b].size(); ++i) {
      const int32_t layer = pieces[piece_of[first[b] + i]].layer;
      auto at =
          std::find_if(by_layer.begin(), by_layer.end(), [&](const auto& l) { return l.first == layer; });
      if (at == by_layer.end()) at = by_layer.insert(at, {layer, Slices{}});
      for (int x = 0; x < 8; ++x) at->second[x] |= fragments[b][i][x];
    }
    for (const auto& [layer, slices] : by_layer) {
      const bool whole = by_layer.size() == 1;
      result.parts.push_back(
          {static_cast<int32_t>(b), layer, whole ? -1 : static_cast<int32_t>(result.masks.size())});
      if (!whole) result.masks.push_back(maskOf(slices));
    }
    result.first.push_back(static_cast<int32_t>(result.parts.size()));
  }
  return result;
}

}  // namespace vdb_diffuse
