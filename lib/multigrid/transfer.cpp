#include "multigrid/transfer.h"

#include <algorithm>

#include "multigrid/block_kernel.h"

namespace vdb_diffuse {
namespace {

// Coarse neighbours lie two voxels apart: about half the conductance of each path. A little less makes up for
// the smoothness that interpolation lacks: 9 instead of 10 iterations to 1e-6 on a cloud of 5 M voxels.
constexpr float kTwiceAsFar = 0.45f;
constexpr int kSpill = 96;  // 6 faces of 4 x 4 coarse voxels

Coord octantOf(const Coord& fine_origin) {
  return Coord((fine_origin[0] >> 1) & 4, (fine_origin[1] >> 1) & 4, (fine_origin[2] >> 1) & 4);
}

/// The weights of a row of eight voxels: the parent, and the coarse voxels across the outer faces along x, y,
/// z.
struct RowWeights {
  Row parent, x, y, z;
};

// 1.5 times its share gives each of three outer faces out of six equal ones a quarter, which is linear
// interpolation; a little less suits ragged edges, and takes no more iterations inside.
constexpr float kLinear = 1.2f;
// A voxel keeps at least this much of its own parent, or the parent's other children would not feel it.
constexpr float kParentAtLeast = 0.25f;

VDB_DIFFUSE_INLINE RowWeights rowWeights(const BlockFaces& g, int x, int y) {
  constexpr RowMask kOdd = {0, -1, 0, -1, 0, -1, 0, -1};
  const Row gx = loadRow(g.x[x + (x & 1)][y]), gy = loadRow(g.y[x][y + (y & 1)]);
  const Row gz = kOdd ? loadRow(g.above[x][y]) : loadRow(g.below[x][y]);
  const Row outer = gx + gy + gz, sum = rowOfConductance(g, x, y);
  // kLinear / sum, but so small that the outer weights together leave the parent its part; 0 / 0 is no
  // weight.
  const Row at_most = (1 - kParentAtLeast) * sum, wanted = kLinear * outer;
  const Row share = (wanted > at_most ? (1 - kParentAtLeast) / outer : kLinear / sum);
  const Row zero = {};
  const Row scale = sum > 0 ? share : zero;
  return {1 - scale * outer, scale * gx, scale * gy, scale * gz};
}

/// Four coarse values in a row, each for its two fine voxels.
VDB_DIFFUSE_INLINE Row spread(const float* p) {
  return Row{p[0], p[0], p[1], p[1], p[2], p[2], p[3], p[3]};
}
/// The coarse value across the outer face along z of each fine voxel.
VDB_DIFFUSE_INLINE Row spreadOuter(const float* p) {
  return Row{p[-1], p[1], p[0], p[2], p[1], p[3], p[2], p[4]};
}

/// The coarse values that a fine block sees: its octant's 4^3 and one layer around it, from the parent block
/// and the parent's neighbours.
struct CoarseHalo {
  float v[6][6][6] = {};
  float& at(int x, int y, int z) { return v[x + 1][y + 1][z + 1]; }
};

VDB_DIFFUSE_INLINE void loadCoarseHalo(const Topology& coarse, const Field<float>& e, int32_t parent,
                                       const Coord& octant, CoarseHalo& halo) {
  const float* own = e.block(parent);
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 4; ++y)
      for (int z = 0; z < 4; ++z)
        halo.at(x, y, z) = own[voxelOffset(octant[0] + x, octant[1] + y, octant[2] + z)];
  const std::array<int32_t, 6>& near = coarse.neighbours(parent);
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2, up = face % 2;
    const bool inside =
        (octant[axis] != 0) != (up != 0);  // the next octant along the face is in the same block
    const float* block = inside ? own : near[face] == kNoBlock ? nullptr : e.block(near[face]);
    if (!block) continue;
    Coord p;
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    for (int j = 0; j < 4; ++j)
      for (int k = 0; k < 4; ++k) {
        p[axis] = (octant[axis] + (up ? 4 : -1)) & 7;
        p[b] = octant[b] + j;
        p[c] = octant[c] + k;
        int q[3];
        q[axis] = up ? 4 : -1;
        q[b] = j;
        q[c] = k;
        halo.at(q[0], q[1], q[2]) = block[voxelOffset(p[0], p[1], p[2])];
      }
  }
}

const BlockMask& maskOf(const Operator& A, const Transfer& transfer, size_t p) {
  const Part& part = transfer.parts.parts[p];
  return part.mask < 0 ? A.topology->active(part.block) : transfer.parts.masks[part.mask];
}

VDB_DIFFUSE_KERNEL void prolongToPart(const Operator& A, const Transfer& transfer, const Topology& coarse,
                                      const Field<float>& e, Field<float>& x, size_t part) {
  const size_t b = static_cast<size_t>(transfer.parts.parts[part].block);
  float* out = x.block(b);
  prefetchBlock(out);
  BlockFaces g;
  CoarseHalo c;
  loadFaces(A, b, g);
  loadCoarseHalo(coarse, e, transfer.parent[part], octantOf(A.topology->origin(b)), c);
  const uint8_t* rows = rowBits(maskOf(A, transfer, part));
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j) {
      if (!rows[i * 8 + j]) continue;
      const RowWeights w = rowWeights(g, i, j);
      const float* own = &c.at(i >> 1, j >> 1, 0);
      const float* next_x = &c.at((i >> 1) + (i & 1 ? 1 : -1), j >> 1, 0);
      const float* next_y = &c.at(i >> 1, (j >> 1) + (j & 1 ? 1 : -1), 0);
      const Row value =
          w.parent * spread(own) + w.x * spread(next_x) + w.y * spread(next_y) + w.z * spreadOuter(own);
      const int n = voxelOffset(i, j, 0);
      const Row zero = {};
      storeRow(out + n, loadRow(out + n) + (rowMask(rows[i * 8 + j]) ? value : zero));
    }
}

/// Adds the sum of each two neighbours of a row to four coarse values.
VDB_DIFFUSE_INLINE void addPairs(Row row, float* to) {
  for (int m = 0; m < 4; ++m) to[m] += row[2 * m] + row[2 * m + 1];
}

VDB_DIFFUSE_KERNEL void restrictPart(const Operator& A, const Field<float>& b, const Field<float>& x,
                                     Transfer& transfer, Field<float>& coarse_b, size_t part) {
  const size_t block = static_cast<size_t>(transfer.parts.parts[part].block);
  const uint8_t* rows = rowBits(maskOf(A, transfer, part));
  const float *rhs = b.block(block), *sink = A.sink.block(block);
  prefetchBlock(x.block(block));
  prefetchBlock(rhs);
  prefetchBlock(sink);
  BlockFaces g;
  Halo<float> u;
  loadFaces(A, block, g);
  loadHalo(*A.topology, x, block, 0.0f, u);
  float sum[6][6][6] = {};
  const Row zero = {};
  for (int m = 0; m < 4; ++m)
    for (int n = 0; n < 4; ++n) {  // the four rows of coarse voxels (m, n): summed as rows, then pair by pair
      Row own = zero, up = zero, next_x[2] = {zero, zero}, next_y[2] = {zero, zero};
      bool any = false;
      for (int c = 0; c < 4; ++c) {
        const int i = 2 * m + (c >> 1), j = 2 * n + (c & 1), at = voxelOffset(i, j, 0);
        if (!rows[i * 8 + j]) continue;
        any = true;
        const Row residual =
            loadRow(rhs + at) - (rowOfDifferences(g, u, i, j) + loadRow(sink + at) * loadRow(u.row(i, j)));
        const Row r = rowMask(rows[i * 8 + j]) ? residual : zero;
        const RowWeights w = rowWeights(g, i, j);
        own += w.parent * r;
        up += w.z * r;
        next_x[c >> 1] += w.x * r;
        next_y[c & 1] += w.y * r;
      }
      if (!any) continue;
      addPairs(own, &sum[m + 1][n + 1][1]);
      for (int side = 0; side < 2; ++side) {
        addPairs(next_x[side], &sum[m + 2 * side][n + 1][1]);
        addPairs(next_y[side], &sum[m + 1][n + 2 * side][1]);
      }
      for (int k = 0; k < 4; ++k) {
        sum[m + 1][n + 1][k] += up[2 * k];
        sum[m + 1][n + 1][k + 2] += up[2 * k + 1];
      }
    }
  const Coord octant = octantOf(A.topology->origin(block));
  float* out = coarse_b.block(transfer.parent[part]);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      for (int k = 0; k < 4; ++k)
        out[voxelOffset(octant[0] + i, octant[1] + j, octant[2] + k)] = sum[i + 1][j + 1][k + 1];
  float* spill = transfer.spill.data() + part * kSpill;
  for (int j = 0; j < 4; ++j)
    for (int k = 0; k < 4; ++k) {
      spill[Topology::kMinusX * 16 + j * 4 + k] = sum[0][j + 1][k + 1];
      spill[Topology::kPlusX * 16 + j * 4 + k] = sum[5][j + 1][k + 1];
      spill[Topology::kMinusY * 16 + j * 4 + k] = sum[j + 1][0][k + 1];
      spill[Topology::kPlusY * 16 + j * 4 + k] = sum[j + 1][5][k + 1];
      spill[Topology::kMinusZ * 16 + j * 4 + k] = sum[j + 1][k + 1][0];
      spill[Topology::kPlusZ * 16 + j * 4 + k] = sum[j + 1][k + 1][5];
    }
}

void gatherSpill(const Topology& fine, const Transfer& transfer, Field<float>& coarse_b, size_t part) {
  const Coord octant = octantOf(fine.origin(transfer.parts.parts[part].block));
  float* out = coarse_b.block(transfer.parent[part]);
  for (int face = 0; face < 6; ++face) {
    const int32_t near = transfer.neighbour[part][face];
    if (near < 0) continue;
    const float* spill = transfer.spill.data() + static_cast<size_t>(near) * kSpill + (face ^ 1) * 16;
    const int at = face % 2 ? 3 : 0;
    for (int j = 0; j < 4; ++j)
      for (int k = 0; k < 4; ++k) {
        const Coord p = face / 2 == 0 ? Coord(at, j, k) : face / 2 == 1 ? Coord(j, at, k) : Coord(j, k, at);
        out[voxelOffset(octant[0] + p[0], octant[1] + p[1], octant[2] + p[2])] += spill[j * 4 + k];
      }
  }
}

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

void restrictResidual(const Operator& A, const Field<float>& b, const Field<float>& x, Transfer& transfer,
                      Field<float>& coarse_b) {
  const size_t parts = transfer.parts.parts.size();
  forEachBlock(parts, [&](size_t part) { restrictPart(A, b, x, transfer, coarse_b, part); });
  forEachBlock(parts, [&](size_t part) { gatherSpill(*A.topology, transfer, coarse_b, part); });
}

void prolong(const Operator& A, const Transfer& transfer, const Topology& coarse_topology,
             const Field<float>& e, Field<float>& x) {
  const std::vector<int32_t>& first = transfer.parts.first;
  forEachBlock(A.topology->blockCount(), [&](size_t b) {
    for (int32_t part = first[b]; part < first[b + 1]; ++part)
      prolongToPart(A, transfer, coarse_topology, e, x, static_cast<size_t>(part));
  });
}

}  // namespace vdb_diffuse
