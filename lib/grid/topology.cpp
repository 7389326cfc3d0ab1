#include "grid/topology.h"

#include <tbb/parallel_sort.h>

#include <numeric>

#include "grid/parallel.h"

namespace vdb_diffuse {
namespace {

/// Signed coordinates in an order that unsigned comparison keeps.
uint32_t biased(int32_t v) {
  return static_cast<uint32_t>(v) ^ 0x80000000u;
}

/// Morton order without building codes: the axis whose highest differing bit is highest decides.
bool mortonLess(const Coord& a, const Coord& b) {
  int axis = 0;
  uint32_t widest = 0;
  for (int i = 0; i < 3; ++i) {
    const uint32_t differ = biased(a[i]) ^ biased(b[i]);
    if (widest < differ && widest < (widest ^ differ)) {
      axis = i;
      widest = differ;
    }
  }
  return biased(a[axis]) < biased(b[axis]);
}

// A dense table answers in one load. It may cost 4 bytes for each block that the bounding box could hold,
// up to about this many times the blocks there are (a block of floats is 2048 bytes).
constexpr double kDenseTableFactor = 64;

}  // namespace

Topology::Topology(std::vector<Coord> origins, std::vector<BlockMask> active) {
  std::vector<uint32_t> order;
  order.reserve(origins.size());
  for (size_t i = 0; i < origins.size(); ++i)
    if (!active[i].isOff()) order.push_back(static_cast<uint32_t>(i));
  tbb::parallel_sort(order.begin(), order.end(),
                     [&](uint32_t a, uint32_t b) { return mortonLess(origins[a], origins[b]); });
  origins_.resize(order.size());
  active_.resize(order.size());
  forEachBlock(order.size(), [&](size_t b) {
    origins_[b] = origins[order[b]];
    active_[b] = active[order[b]];
  });
  if (origins_.empty()) return;

  lowest_ = highest_ = origins_[0];
  for (const Coord& origin : origins_) {
    lowest_.minComponent(origin);
    highest_.maxComponent(origin);
  }
  double box_blocks = 1;
  for (int a = 0; a < 3; ++a) {
    const int64_t blocks = (int64_t(highest_[a]) - lowest_[a]) / kBlockWidth + 1;
    table_size_[a] = static_cast<int>(blocks);
    box_blocks *= static_cast<double>(blocks);
  }
  highest_.offset(kBlockWidth - 1);

  dense_ = box_blocks <= kDenseTableFactor * static_cast<double>(origins_.size()) + 4096;
  size_t slots = 16;
  while (!dense_ && slots < 2 * origins_.size()) slots *= 2;
  table_.assign(dense_ ? static_cast<size_t>(box_blocks) : slots, kNoBlock);
  for (size_t b = 0; b < origins_.size(); ++b) {
    size_t slot = hashSlot(origins_[b]);
    while (!dense_ && table_[slot] != kNoBlock) slot = (slot + 1) & (table_.size() - 1);
    table_[slot] = static_cast<int32_t>(b);
  }

  neighbours_.resize(origins_.size());
  forEachBlock(origins_.size(), [&](size_t b) {
    for (int face = 0; face < 6; ++face) {
      Coord across = origins_[b];
      across[face / 2] += face % 2 ? kBlockWidth : -kBlockWidth;
      neighbours_[b][face] = find(across);
    }
  });
  active_voxels_ = sumOverBlocks<size_t>(origins_.size(), [&](size_t b) { return active_[b].countOn(); });
}

size_t Topology::hashSlot(const Coord& origin) const {
  if (dense_) {
    const size_t x = static_cast<size_t>((origin[0] - lowest_[0]) / kBlockWidth);
    const size_t y = static_cast<size_t>((origin[1] - lowest_[1]) / kBlockWidth);
    const size_t z = static_cast<size_t>((origin[2] - lowest_[2]) / kBlockWidth);
    return (x * table_size_[1] + y) * table_size_[2] + z;
  }
  uint64_t key = uint64_t(biased(origin[0]) >> 3) * 0x9E3779B97F4A7C15ull;
  key = (key ^ (key >> 29) ^ (biased(origin[1]) >> 3)) * 0xBF58476D1CE4E5B9ull;
  key = (key ^ (key >> 32) ^ (biased(origin[2]) >> 3)) * 0x94D049BB133111EBull;
  return static_cast<size_t>(key ^ (key >> 31)) & (table_.size() - 1);
}

int32_t Topology::find(const Coord& origin) const {
  for (int a = 0; a < 3; ++a)
    if (origin[a] < lowest_[a] || origin[a] > highest_[a]) return kNoBlock;
  size_t slot = hashSlot(origin);
  if (dense_) return table_[slot];
  while (table_[slot] != kNoBlock && origins_[table_[slot]] != origin)
    slot = (slot + 1) & (table_.size() - 1);
  return table_[slot];
}

bool Topology::isActive(const Coord& p_index) const {
  const int32_t b = find(blockOriginOf(p_index));
  return b != kNoBlock && active_[b].isOn(voxelOffset(p_index[0] & 7, p_index[1] & 7, p_index[2] & 7));
}

size_t Topology::bytes() const {
  return origins_.size() * (sizeof(Coord) + sizeof(BlockMask) + sizeof(neighbours_[0])) +
         table_.size() * sizeof(int32_t);
}

std::array<BlockMask, 6> Topology::outerFaces(size_t block) const {
  // A word of a mask is a slice along x: bit 8 y + z.
  constexpr uint64_t kLowZ = 0x0101010101010101u, kHighZ = kLowZ << 7;
  const BlockMask& own = active_[block];
  const auto word = [](const BlockMask& mask, int x) {
    return mask.getWord<uint64_t>(static_cast<openvdb::Index>(x));
  };
  const auto slice = [&](Face face, int x) -> uint64_t {
    const int32_t near = neighbours_[block][face];
    return near == kNoBlock ? 0 : word(active_[near], x);
  };
  std::array<BlockMask, 6> outer;
  for (int x = 0; x < kBlockWidth; ++x) {
    const uint64_t on = word(own, x);
    const uint64_t across[6] = {x > 0 ? word(own, x - 1) : slice(kMinusX, 7),
                                x < 7 ? word(own, x + 1) : slice(kPlusX, 0),
                                on << 8 | slice(kMinusY, x) >> 56,
                                on >> 8 | slice(kPlusY, x) << 56,
                                (on << 1 & ~kLowZ) | (slice(kMinusZ, x) >> 7 & kLowZ),
                                (on >> 1 & ~kHighZ) | (slice(kPlusZ, x) << 7 & kHighZ)};
    for (int face = 0; face < 6; ++face)
      outer[face].getWord<uint64_t>(static_cast<openvdb::Index>(x)) = on & ~across[face];
  }
  return outer;
}

std::pair<Coord, Coord> Topology::activeBox() const {
  Coord low = Coord::max(), high = Coord::min();
  for (size_t b = 0; b < blockCount(); ++b) {
    bool inside = true;  // of what has been found: most blocks are
    for (int a = 0; a < 3; ++a)
      inside = inside && origin(b)[a] >= low[a] && origin(b)[a] + kBlockWidth - 1 <= high[a];
    if (inside) continue;
    for (auto it = active(b).beginOn(); it; ++it) {
      const Coord p = origin(b) + voxelLocal(static_cast<int>(it.pos()));
      low.minComponent(p);
      high.maxComponent(p);
    }
  }
  return {low, high};
}

}  // namespace vdb_diffuse
