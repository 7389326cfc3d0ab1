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
    coarsenMask(part.mask < 0 ? fine.active(part.block) : parts.masks[part.mask],
                octantOf(fine.origin(part.block)), masks.back());
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
VDB_DIFFUSE_KERNEL void coarsenPart(const Operator& fine, const Transfer& transfer, Operator& coarse,
                                    size_t p) {
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
  const Row half = kTwiceAsFar - Row{};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      const int x = 2 * i, y = 2 * j, to = voxelOffset(octant[0] + i, octant[1] + j, octant[2]);
      const auto four = [&](const float(&rows)[8][8][8]) VDB_DIFFUSE_INLINED {
        return (loadRow(rows[x][y]) + loadRow(rows[x][y + 1])) +
               (loadRow(rows[x + 1][y]) + loadRow(rows[x + 1][y + 1]));
      };
      const float* own = sink + voxelOffset(x, y, 0);
      storePairSums((loadRow(own) + loadRow(own + 8)) + (loadRow(own + 64) + loadRow(own + 72)),
                    coarse.sink.block(parent) + to);
      storePairSums(half * (loadRow(g.x[x][y]) + loadRow(g.x[x][y + 1])), coarse.faces[0].block(parent) + to);
      storePairSums(half * (loadRow(g.y[x][y]) + loadRow(g.y[x + 1][y])), coarse.faces[1].block(parent) + to);
      const Row below = half * four(g.below);
      for (int k = 0; k < 4; ++k) coarse.faces[2].block(parent)[to + k] = below[2 * k];
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
