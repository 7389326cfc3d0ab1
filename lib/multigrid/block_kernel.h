#pragma once

#include <algorithm>
#include <limits>

#include "grid/row.h"
#include "multigrid/operator.h"

// One block at a time: its values with one layer of neighbours, its conductances, and the row of A.
// Everything lives in the first-level cache while it is worked on.

namespace vdb_diffuse {

/// The row one voxel further up, `low` taking the free place; and one further down, with `high`. Loading a
/// row at an offset would wait for the store that has just written it.
VDB_DIFFUSE_INLINE Row shiftedUp(Row row, float low) {
  const Row fill = low - Row{};
  return __builtin_shuffle(row, fill, RowMask{8, 0, 1, 2, 3, 4, 5, 6});
}
VDB_DIFFUSE_INLINE Row shiftedDown(Row row, float high) {
  const Row fill = high - Row{};
  return __builtin_shuffle(row, fill, RowMask{1, 2, 3, 4, 5, 6, 7, 8});
}

/// A block's values and the six layers around it: rows along z, with the values below and above each apart.
/// All that a kernel touches should fit in the first-level cache together.
template <typename T>
struct alignas(64) Halo {
  T v[10][10][8];  ///< (x, y) of the block stands at [x+1][y+1]
  T below[8][8], above[8][8];
  T* row(int x, int y) { return v[x + 1][y + 1]; }
  const T* row(int x, int y) const { return v[x + 1][y + 1]; }
  /// Any voxel of the block or across one of its faces.
  T at(int x, int y, int z) const { return z < 0 ? below[x][y] : z > 7 ? above[x][y] : row(x, y)[z]; }
};

/// Eight values; a call of memmove, or of its string instructions, would cost more than they do.
template <typename T>
VDB_DIFFUSE_INLINE void copyRow(const T* from, T* to) {
  __builtin_memcpy(to, from, 8 * sizeof(T));
}
VDB_DIFFUSE_INLINE void copyRows(const float* from, float* to, int rows) {
  for (int r = 0; r < rows; ++r) storeRow(to + 8 * r, loadRow(from + 8 * r));
}
VDB_DIFFUSE_INLINE void clearRows(float* to, int rows) {
  for (int r = 0; r < rows; ++r) storeRow(to + 8 * r, Row{});
}

/// Asks for a block's values ahead of their use: blocks are visited out of order, which the processor's own
/// prefetching does not foresee, and the conductances take long enough to form to hide the wait.
VDB_DIFFUSE_INLINE void prefetchBlock(const float* block) {
  constexpr int kFloatsPerLine = 16;
  for (int n = 0; n < kBlockVoxels; n += kFloatsPerLine) __builtin_prefetch(block + n);
}

template <typename T>
VDB_DIFFUSE_INLINE void loadHalo(const Topology& topology, const Field<T>& field, size_t b, T outside,
                                 Halo<T>& halo) {
  const T* own = field.block(b);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) copyRow(own + x * 64 + y * 8, halo.row(x, y));
  const std::array<int32_t, 6>& near = topology.neighbours(b);
  const auto layer = [&](int face) { return near[face] == kNoBlock ? nullptr : field.block(near[face]); };
  if (const T* n = layer(Topology::kMinusX))
    for (int y = 0; y < 8; ++y) copyRow(n + 7 * 64 + y * 8, halo.row(-1, y));
  else
    for (int y = 0; y < 8; ++y) std::fill_n(halo.row(-1, y), 8, outside);
  if (const T* n = layer(Topology::kPlusX))
    for (int y = 0; y < 8; ++y) copyRow(n + y * 8, halo.row(8, y));
  else
    for (int y = 0; y < 8; ++y) std::fill_n(halo.row(8, y), 8, outside);
  if (const T* n = layer(Topology::kMinusY))
    for (int x = 0; x < 8; ++x) copyRow(n + x * 64 + 7 * 8, halo.row(x, -1));
  else
    for (int x = 0; x < 8; ++x) std::fill_n(halo.row(x, -1), 8, outside);
  if (const T* n = layer(Topology::kPlusY))
    for (int x = 0; x < 8; ++x) copyRow(n + x * 64, halo.row(x, 8));
  else
    for (int x = 0; x < 8; ++x) std::fill_n(halo.row(x, 8), 8, outside);
  const T* below = layer(Topology::kMinusZ);
  const T* above = layer(Topology::kPlusZ);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      halo.below[x][y] = below ? below[x * 64 + y * 8 + 7] : outside;
      halo.above[x][y] = above ? above[x * 64 + y * 8] : outside;
    }
}

/// Conductances of all faces of a block's voxels: x[i] lies between x = i-1 and x = i, y likewise; along z,
/// where a row's eight voxels are one register, the faces below and above each voxel stand apart.
struct alignas(64) BlockFaces {
  float x[9][8][8];
  float y[8][9][8];
  float below[8][8][8], above[8][8][8];
};

VDB_DIFFUSE_INLINE void cutBlockFaces(const CutFaces& cuts, BlockFaces& g) {
  const auto zero = [&](int face, auto&& at) {
    for (auto it = cuts.cut[face].beginOn(); it; ++it) {
      const Coord p = voxelLocal(it.pos());
      at(p[0], p[1], p[2]) = 0;
    }
  };
  zero(Topology::kMinusX, [&](int x, int y, int z) -> float& { return g.x[x][y][z]; });
  zero(Topology::kPlusX, [&](int x, int y, int z) -> float& { return g.x[x + 1][y][z]; });
  zero(Topology::kMinusY, [&](int x, int y, int z) -> float& { return g.y[x][y][z]; });
  zero(Topology::kPlusY, [&](int x, int y, int z) -> float& { return g.y[x][y + 1][z]; });
  zero(Topology::kMinusZ, [&](int x, int y, int z) -> float& { return g.below[x][y][z]; });
  zero(Topology::kPlusZ, [&](int x, int y, int z) -> float& { return g.above[x][y][z]; });
}

VDB_DIFFUSE_INLINE void loadFaces(const Operator& A, size_t b, BlockFaces& g) {
  const Topology& topology = *A.topology;
  if (A.finest()) {
    Halo<float> r;
    loadHalo(topology, A.half_resistance, b, std::numeric_limits<float>::infinity(), r);
    for (int x = 0; x < 9; ++x)
      for (int y = 0; y < 8; ++y)
        storeRow(g.x[x][y], A.scale[0] / (loadRow(r.row(x - 1, y)) + loadRow(r.row(x, y))));
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 9; ++y)
        storeRow(g.y[x][y], A.scale[1] / (loadRow(r.row(x, y - 1)) + loadRow(r.row(x, y))));
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 8; ++y) {
        const Row own = loadRow(r.row(x, y)), below = A.scale[2] / (shiftedUp(own, r.below[x][y]) + own);
        storeRow(g.below[x][y], below);
        storeRow(g.above[x][y], shiftedDown(below, A.scale[2] / (own[7] + r.above[x][y])));
      }
    if (!A.cuts.empty()) {
      const auto found = A.cuts.find(static_cast<int32_t>(b));
      if (found != A.cuts.end()) cutBlockFaces(found->second, g);
    }
    return;
  }
  const std::array<int32_t, 6>& near = topology.neighbours(b);
  const int32_t right = near[Topology::kPlusX], back = near[Topology::kPlusY], above = near[Topology::kPlusZ];
  copyRows(A.faces[0].block(b), &g.x[0][0][0], 64);
  if (right != kNoBlock)
    copyRows(A.faces[0].block(right), &g.x[8][0][0], 8);
  else
    clearRows(&g.x[8][0][0], 8);
  for (int x = 0; x < 8; ++x) {
    copyRows(A.faces[1].block(b) + x * 64, &g.y[x][0][0], 8);
    if (back != kNoBlock)
      copyRow(A.faces[1].block(back) + x * 64, &g.y[x][8][0]);
    else
      clearRows(&g.y[x][8][0], 1);
    for (int y = 0; y < 8; ++y) {
      const Row below = loadRow(A.faces[2].block(b) + x * 64 + y * 8);
      storeRow(g.below[x][y], below);
      storeRow(g.above[x][y],
               shiftedDown(below, above != kNoBlock ? A.faces[2].block(above)[x * 64 + y * 8] : 0.0f));
    }
  }
}

/// Sum over faces of g (x_i - x_j) for the eight voxels of a row.
VDB_DIFFUSE_INLINE Row rowOfDifferences(const BlockFaces& g, const Halo<float>& u, int x, int y) {
  const Row c = loadRow(u.row(x, y));
  const Row along_x = loadRow(g.x[x][y]) * (c - loadRow(u.row(x - 1, y))) +
                      loadRow(g.x[x + 1][y]) * (c - loadRow(u.row(x + 1, y)));
  const Row along_y = loadRow(g.y[x][y]) * (c - loadRow(u.row(x, y - 1))) +
                      loadRow(g.y[x][y + 1]) * (c - loadRow(u.row(x, y + 1)));
  const Row along_z = loadRow(g.below[x][y]) * (c - shiftedUp(c, u.below[x][y])) +
                      loadRow(g.above[x][y]) * (c - shiftedDown(c, u.above[x][y]));
  return (along_x + along_y) + along_z;
}

/// Sum of the six conductances for the eight voxels of a row.
VDB_DIFFUSE_INLINE Row rowOfConductance(const BlockFaces& g, int x, int y) {
  return (loadRow(g.x[x][y]) + loadRow(g.x[x + 1][y])) + (loadRow(g.y[x][y]) + loadRow(g.y[x][y + 1])) +
         (loadRow(g.below[x][y]) + loadRow(g.above[x][y]));
}

}  // namespace vdb_diffuse
