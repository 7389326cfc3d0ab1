#include "multigrid/transfer.h"

#include <algorithm>

#include "multigrid/block_transfer.h"

namespace vdb_diffuse {
namespace {

// Coarse neighbours lie two voxels apart: about half the conductance of each path. A little less makes up for
// the smoothness that interpolation lacks: 9 instead of 10 iterations to 1e-6 on a cloud of 5 M voxels.
constexpr float kTwiceAsFar = 0.45f;

/// Coarse place of a part's block. Layers lie side by side along x, a power of two apart, so that they stay
/// apart on all coarser levels.
Coord coarseOrigin(const Coord& fine, int32_t layer, int32_t layer_distance) {
  return Coord(((fine[0] >> 1) & ~7) + layer * layer_distance, (fine[1] >> 1) & ~7, (fine[2] >> 1) & ~7);
}

/// Half the smallest power of two that exceeds the volume's extent; 0 where the layers would not fit in the
/// index space.
int32_t layerDistance(const Topology& fine, int32_t layers) {
  int64_t distance = 64;
  while (distance < int64_t(fine.highest()[0]) - fine.lowest()[0] + 1) distance *= 2;
  return fine.highest()[0] / 2 + distance * layers < (int64_t{1} << 30) ? static_cast<int32_t>(distance) : 0;
}

std::shared_ptr<const Topology> coarseTopology(const Topology& fine, const Parts& parts,
                                               int32_t layer_distance) {
  std::vector<std::pair<Coord, size_t>> order;
  order.reserve(parts.parts.size());
  for (size_t p = 0; p < parts.parts.size(); ++p)
    order.emplace_back(coarseOrigin(fine.origin(parts.parts[p].block), parts.parts[p].layer, layer_distance),
                       p);
  // Blocks stand in Morton order, so with one layer the children of a coarse block are consecutive already.
  if (parts.layers > 1) std::sort(order.begin(), order.end());
  std::vector<Coord> origins;
  std::vector<BlockMask> masks;
  for (const auto& [origin, p] : order) {
    const Part& part = parts.parts[p];
    if (origins.empty() || origins.back() != origin) {
      origins.push_back(origin);
      masks.emplace_back();
    }
    const Coord octant = octantOf(fine.origin(part.block));
    const BlockMask& own = part.mask < 0 ? fine.active(part.block) : parts.masks[part.mask];
    for (auto it = own.beginOn(); it; ++it) {
      const Coord q = voxelLocal(it.pos());
      masks.back().setOn(voxelOffset(octant[0] + q[0] / 2, octant[1] + q[1] / 2, octant[2] + q[2] / 2));
    }
  }
  return std::make_shared<const Topology>(std::move(origins), std::move(masks));
}

/// Leaves only the faces below voxels of the part: what conducts joins voxels of one part.
void keepPart(const BlockMask& own, BlockFaces& g) {
  for (int n = 0; n < kBlockVoxels; ++n) {
    if (own.isOn(n)) continue;
    const Coord p = voxelLocal(n);
    g.x[p[0]][p[1]][p[2]] = g.y[p[0]][p[1]][p[2]] = g.below[p[0]][p[1]][p[2]] = 0;
  }
}

/// Coarse faces and sinks of the octant that one part fills.
void coarsenPart(const Operator& fine, const Transfer& transfer, Operator& coarse, size_t p) {
  const Part& part = transfer.parts.parts[p];
  const size_t b = static_cast<size_t>(part.block), parent = static_cast<size_t>(transfer.parent[p]);
  BlockFaces g;
  loadFaces(fine, b, g);
  float sink[kBlockVoxels];
  std::copy_n(fine.sink.block(b), kBlockVoxels, sink);
  if (part.mask >= 0) {
    const BlockMask& own = transfer.parts.masks[part.mask];
    keepPart(own, g);
    for (int n = 0; n < kBlockVoxels; ++n)
      if (!own.isOn(n)) sink[n] = 0;
  }
  const Coord octant = octantOf(fine.topology->origin(b));
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      for (int k = 0; k < 4; ++k) {
        const int x = 2 * i, y = 2 * j, z = 2 * k,
                  to = voxelOffset(octant[0] + i, octant[1] + j, octant[2] + k);
        float sum = 0;
        for (int c = 0; c < 8; ++c) sum += sink[voxelOffset(x + (c >> 2), y + ((c >> 1) & 1), z + (c & 1))];
        coarse.sink.block(parent)[to] = sum;
        coarse.faces[0].block(parent)[to] =
            kTwiceAsFar * (g.x[x][y][z] + g.x[x][y][z + 1] + g.x[x][y + 1][z] + g.x[x][y + 1][z + 1]);
        coarse.faces[1].block(parent)[to] =
            kTwiceAsFar * (g.y[x][y][z] + g.y[x][y][z + 1] + g.y[x + 1][y][z] + g.y[x + 1][y][z + 1]);
        coarse.faces[2].block(parent)[to] = kTwiceAsFar * (g.below[x][y][z] + g.below[x][y + 1][z] +
                                                           g.below[x + 1][y][z] + g.below[x + 1][y + 1][z]);
      }
}

}  // namespace

Operator coarsen(const Operator& fine, Parts parts, Transfer& transfer) {
  Operator coarse;
  int32_t layer_distance = layerDistance(*fine.topology, parts.layers);
  if (layer_distance == 0) parts = wholeBlocks(*fine.topology);
  coarse.topology = coarseTopology(*fine.topology, parts, layer_distance);
  transfer.parts = std::move(parts);
  const Parts& p = transfer.parts;
  transfer.parent.resize(p.parts.size());
  transfer.neighbour.resize(p.parts.size());
  forEachBlock(p.parts.size(), [&](size_t i) {
    const Part& part = p.parts[i];
    transfer.parent[i] =
        coarse.topology->find(coarseOrigin(fine.topology->origin(part.block), part.layer, layer_distance));
    for (int face = 0; face < 6; ++face) {
      const int32_t near = fine.topology->neighbours(part.block)[face];
      transfer.neighbour[i][face] = -1;
      if (near == kNoBlock) continue;
      for (int32_t j = p.first[near]; j < p.first[near + 1]; ++j)
        if (p.parts[j].layer == part.layer) transfer.neighbour[i][face] = j;
    }
  });
  transfer.spill = Field<float>((p.parts.size() * kSpill + kBlockVoxels - 1) / kBlockVoxels);
  for (Field<float>& faces : coarse.faces) faces = Field<float>(*coarse.topology);
  coarse.sink = Field<float>(*coarse.topology);
  forEachBlock(p.parts.size(), [&](size_t i) { coarsenPart(fine, transfer, coarse, i); });
  formDiagonal(coarse);
  return coarse;
}

}  // namespace vdb_diffuse
