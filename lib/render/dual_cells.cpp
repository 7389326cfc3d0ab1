#include "render/dual_cells.h"

#include <algorithm>

#include "grid/parallel.h"

namespace vdb_diffuse {
namespace {

/// Step from a block to the i-th of the eight that share its upper corner.
Coord blockStep(int i) {
  return Coord(((i >> 2) & 1) * kBlockWidth, ((i >> 1) & 1) * kBlockWidth, (i & 1) * kBlockWidth);
}

std::array<int32_t, 8> blocksFrom(const Topology& voxels, const Coord& origin) {
  std::array<int32_t, 8> blocks;
  for (int i = 0; i < 8; ++i) blocks[i] = voxels.find(origin + blockStep(i));
  return blocks;
}

BlockMask cellsOf(const Topology& voxels, const std::array<int32_t, 8>& blocks) {
  constexpr int kSide = kBlockWidth + 1;
  bool active[kSide][kSide][kSide];
  for (int x = 0; x < kSide; ++x)
    for (int y = 0; y < kSide; ++y)
      for (int z = 0; z < kSide; ++z) {
        const int32_t block = blocks[(x >> 3) * 4 + (y >> 3) * 2 + (z >> 3)];
        active[x][y][z] = block != kNoBlock && voxels.active(block).isOn(voxelOffset(x & 7, y & 7, z & 7));
      }
  BlockMask mask;
  for (int n = 0; n < kBlockVoxels; ++n) {
    const Coord c = voxelLocal(n);
    bool any = false;
    for (int i = 0; i < 8; ++i) any |= active[c[0] + ((i >> 2) & 1)][c[1] + ((i >> 1) & 1)][c[2] + (i & 1)];
    if (any) mask.setOn(n);
  }
  return mask;
}

}  // namespace

DualCells dualCells(const Topology& voxels) {
  std::vector<Coord> origins;
  origins.reserve(voxels.blockCount() * 8);
  for (size_t b = 0; b < voxels.blockCount(); ++b)
    for (int i = 0; i < 8; ++i) origins.push_back(voxels.origin(b) - blockStep(i));
  std::sort(origins.begin(), origins.end());
  origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
  std::vector<BlockMask> masks(origins.size());
  forEachBlock(origins.size(), [&](size_t b) { masks[b] = cellsOf(voxels, blocksFrom(voxels, origins[b])); });

  DualCells dual;
  dual.cells = Topology(std::move(origins), std::move(masks));
  dual.voxel_blocks.resize(dual.cells.blockCount());
  forEachBlock(dual.cells.blockCount(),
               [&](size_t b) { dual.voxel_blocks[b] = blocksFrom(voxels, dual.cells.origin(b)); });
  return dual;
}

}  // namespace vdb_diffuse
