#pragma once

#include <cstring>

#include "grid/coarse_block.h"
#include "multigrid/block_sweeps.h"
#include "multigrid/transfer.h"

// Between one fine block and its octant of the coarse grid. A fine voxel hangs on its parent and on the
// coarse voxels across its three outer faces,
//
//      +---------+---------+         the voxel o is in the lower half of I along this axis, so its outer
//      |    H    |  o I    |         face leads to H
//      +---------+---------+
//
// along x the face that leaves the pair of planes, along y the one that leaves the braid, and along z the one
// that leaves a pair of lanes: a coarse voxel is two lanes of two braids.

namespace vdb_diffuse {

constexpr int kSpill = 96;  ///< 6 faces of 4 x 4 coarse voxels

/// The weights of a strand's voxels on the coarse voxels across their outer faces; the parent has the rest.
struct OuterWeights {
  Row x, y, z;
};

VDB_DIFFUSE_INLINE OuterWeights outerWeights(const BraidedFaces& g, int x, int n, int s) {
  const Row x_low = loadRow(g.x[n][s]), x_high = loadRow(g.x[n + kNextX][s]);
  const Row below = loadRow(g.below[n][s]), above = loadRow(g.above[n][s]);
  const Row gx = x & 1 ? x_high : x_low, gy = loadRow(g.outer[n][s]), gz = alternate(below, above);
  const Row outer = gx + gy + gz;
  const Row sum = (x_low + x_high) + (loadRow(g.inner[n]) + gy) + (below + above);
  // kLinear / sum, but so small that the parent keeps its part; 0 where nothing conducts.
  const Row a = sum * (1 / kLinear), b = outer * (1 / (1 - kParentAtLeast));
  const Row least = std::numeric_limits<float>::min() - Row{};
  const Row most = a > b ? a : b;
  const Row scale = inverseOf(most > least ? most : least);
  return {scale * gx, scale * gy, scale * gz};
}

/// Lanes of a braid's strand whose voxels are active.
VDB_DIFFUSE_INLINE RowMask lanesOf(const uint8_t* rows, int x, int q, int s) {
  constexpr RowMask kOdd = {0, -1, 0, -1, 0, -1, 0, -1};
  const RowMask a = rowMask(rows[8 * x + 2 * q + s]), b = rowMask(rows[8 * x + 2 * q + 1 - s]);
  return kOdd ? b : a;
}

/// Four values in two lanes each.
VDB_DIFFUSE_INLINE void storePairSums(Row pairs, float* to) {
  const Row sums = pairs + __builtin_shuffle(pairs, RowMask{1, 0, 3, 2, 5, 4, 7, 6});
  const Row packed = __builtin_shuffle(sums, RowMask{0, 2, 4, 6, 0, 2, 4, 6});
  __builtin_memcpy(to, &packed, 4 * sizeof(float));
}

/// What a fine block adds to the coarse right-hand side: pairs of lanes for each coarse voxel of its octant
/// and of the layers across its faces along x and y; along z, the lanes that leave it.
struct alignas(64) CoarseSums {
  float v[6][6][8], past_ends[4][4][8];
  void add(int i, int j, Row row) { storeRow(v[i + 1][j + 1], loadRow(v[i + 1][j + 1]) + row); }
};

/// sums = P^T (right - A u).
/// \param rows      active voxels
/// \param colours   1 or 2: after a sweep the residual of the last colour is zero and can be left out
VDB_DIFFUSE_INLINE void restrictBlock(const BlockSystem& system, const uint8_t* rows, int colours,
                                      CoarseSums& sums) {
  clearRows(&sums.v[0][0][0], static_cast<int>(sizeof(sums) / sizeof(Row)));
  constexpr RowMask kPastEnds = {0, -1, 0, 0, 0, 0, -1, 0};
  const Row zero = {};
  for (int m = 0; m < 4; ++m)
    for (int q = 0; q < kBraids; ++q) {
      Row own = zero, along_z = zero, low_y = zero, high_y = zero;
      const uint64_t both = uint64_t{1} << placeOf(2 * m, q) | uint64_t{1} << placeOf(2 * m + 1, q);
      if (!(system.braids & both)) continue;
      for (int up = 0; up < 2; ++up) {
        const int x = 2 * m + up, n = placeOf(x, q);
        if (!(system.braids >> n & 1)) continue;
        Row next_x = zero, next_y[2] = {zero, zero};
        for (int s = 0; s < 2; ++s) {
          if (colours == 1 && s != up) continue;  // colour 0 is strand 0 of even planes
          const Row residual = loadRow(system.right.v[n][s]) - applied(system, n, s);
          const Row r = lanesOf(rows, x, q, s) ? residual : zero;
          const OuterWeights w = outerWeights(system.g, x, n, s);
          const Row rx = w.x * r, ry = w.y * r, rz = w.z * r;
          own += r - (rx + ry + rz);
          next_x += rx;
          next_y[s] = ry;
          along_z += rz;
        }
        low_y += alternate(next_y[0], next_y[1]);
        high_y += alternate(next_y[1], next_y[0]);
        sums.add(up ? m + 1 : m - 1, q, next_x);
      }
      // Lanes of the first of each pair go to the pair before, the others to the next; 0 and 7 leave the
      // block.
      const Row moved = __builtin_shuffle(along_z, RowMask{2, 0, 4, 1, 6, 3, 7, 5});
      storeRow(sums.past_ends[m][q], moved);
      sums.add(m, q, own + (kPastEnds ? zero : moved));
      sums.add(m, q - 1, low_y);
      sums.add(m, q + 1, high_y);
    }
}

VDB_DIFFUSE_INLINE void storeSums(const CoarseSums& sums, const Coord& octant, float* coarse_block,
                                  float* spill) {
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      storePairSums(loadRow(sums.v[i + 1][j + 1]),
                    coarse_block + voxelOffset(octant[0] + i, octant[1] + j, octant[2]));
  for (int j = 0; j < 4; ++j) {
    storePairSums(loadRow(sums.v[0][j + 1]), spill + Topology::kMinusX * 16 + j * 4);
    storePairSums(loadRow(sums.v[5][j + 1]), spill + Topology::kPlusX * 16 + j * 4);
    storePairSums(loadRow(sums.v[j + 1][0]), spill + Topology::kMinusY * 16 + j * 4);
    storePairSums(loadRow(sums.v[j + 1][5]), spill + Topology::kPlusY * 16 + j * 4);
    for (int k = 0; k < 4; ++k) {
      spill[Topology::kMinusZ * 16 + j * 4 + k] = sums.past_ends[j][k][1];
      spill[Topology::kPlusZ * 16 + j * 4 + k] = sums.past_ends[j][k][6];
    }
  }
}

/// The coarse values that a fine block sees: its octant's 4^3 and one layer around it, from the parent block
/// and the parent's neighbours.
struct alignas(64) CoarseHalo {
  float v[6][6][8];
  float* at(int x, int y, int z) { return &v[x + 1][y + 1][z + 1]; }
  Row row(int x, int y) const { return loadRow(v[x + 1][y + 1]); }
};

VDB_DIFFUSE_INLINE void loadCoarseHalo(const Topology& coarse, const Field<float>& e, int32_t parent,
                                       const Coord& octant, CoarseHalo& halo) {
  clearRows(&halo.v[0][0][0], 36);
  const auto copyFour = [](const float* from, float* to)
                            VDB_DIFFUSE_INLINED { __builtin_memcpy(to, from, 4 * sizeof(float)); };
  const float* own = e.block(parent);
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 4; ++y)
      copyFour(own + voxelOffset(octant[0] + x, octant[1] + y, octant[2]), halo.at(x, y, 0));
  const std::array<int32_t, 6>& near = coarse.neighbours(parent);
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2, up = face % 2;
    // The next octant along the face is in the same block, or in the block across it.
    const bool inside = (octant[axis] != 0) != (up != 0);
    const float* block = inside ? own : near[face] == kNoBlock ? nullptr : e.block(near[face]);
    if (!block) continue;
    const int from = (octant[axis] + (up ? 4 : -1)) & 7, to = up ? 4 : -1;
    for (int j = 0; j < 4; ++j) {
      if (axis == 0) copyFour(block + voxelOffset(from, octant[1] + j, octant[2]), halo.at(to, j, 0));
      if (axis == 1) copyFour(block + voxelOffset(octant[0] + j, from, octant[2]), halo.at(j, to, 0));
      if (axis == 2)
        for (int k = 0; k < 4; ++k)
          *halo.at(j, k, to) = block[voxelOffset(octant[0] + j, octant[1] + k, from)];
    }
  }
}

/// u += P e.
/// \param rows  active voxels
VDB_DIFFUSE_INLINE void prolongBlock(const CoarseHalo& e, const uint8_t* rows, BlockSystem& system) {
  const auto inPairs = [&](int i, int j) VDB_DIFFUSE_INLINED {
    return __builtin_shuffle(e.row(i, j), RowMask{1, 1, 2, 2, 3, 3, 4, 4});
  };
  const Row zero = {};
  for (int x = 0; x < 8; ++x)
    for (int q = 0; q < kBraids; ++q) {
      const int n = placeOf(x, q), m = x >> 1;
      if (!(system.braids >> n & 1)) continue;
      const Row own = inPairs(m, q), next_x = inPairs(x & 1 ? m + 1 : m - 1, q);
      const Row low_y = inPairs(m, q - 1), high_y = inPairs(m, q + 1);
      const Row next_z = __builtin_shuffle(e.row(m, q), RowMask{0, 2, 1, 3, 2, 4, 3, 5});
      for (int s = 0; s < 2; ++s) {
        const OuterWeights w = outerWeights(system.g, x, n, s);
        const Row next_y = s == 0 ? alternate(low_y, high_y) : alternate(high_y, low_y);
        const Row value = own + (w.x * (next_x - own) + w.y * (next_y - own) + w.z * (next_z - own));
        storeRow(system.u.at(n, s), loadRow(system.u.at(n, s)) + (lanesOf(rows, x, q, s) ? value : zero));
      }
    }
}

}  // namespace vdb_diffuse
