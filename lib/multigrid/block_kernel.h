#pragma once

#include <algorithm>
#include <limits>

#include "multigrid/operator.h"

// One block at a time: its values with one layer of neighbours, its conductances, and the row of A.
// Everything lives in the first-level cache while it is worked on.

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
/// Compiled for AVX2 as well and chosen when the program starts. The conductances are formed by one addition
/// and one division, so they are the same numbers on either path.
#define VDB_DIFFUSE_KERNEL __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define VDB_DIFFUSE_KERNEL
#endif
#define VDB_DIFFUSE_INLINE inline __attribute__((always_inline))

namespace vdb_diffuse {

/// The eight voxels of a row along z, as one vector register where the processor has it.
using Row = float __attribute__((vector_size(32)));
using RowMask = int __attribute__((vector_size(32)));  ///< per voxel all bits or none
VDB_DIFFUSE_INLINE Row loadRow(const float* p) {
  Row row;
  __builtin_memcpy(&row, p, sizeof row);
  return row;
}
VDB_DIFFUSE_INLINE void storeRow(float* p, Row row) {
  __builtin_memcpy(p, &row, sizeof row);
}

/// Sums are kept in double, eight side by side and then in a fixed order.
using DoubleRow = double __attribute__((vector_size(64)));
VDB_DIFFUSE_INLINE DoubleRow widen(Row row) {
  return __builtin_convertvector(row, DoubleRow);
}
VDB_DIFFUSE_INLINE double sumOf(DoubleRow v) {
  return ((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7]));
}

/// A block's values and the six layers around it. (x, y, z) of the block stands at v[x+1][y+1][z+kShift].
template <typename T>
struct alignas(64) Halo {
  static constexpr int kShift = 4;  // rows of eight start on a vector's boundary
  T v[10][10][16];
  T* row(int x, int y) { return &v[x + 1][y + 1][kShift]; }
  const T* row(int x, int y) const { return &v[x + 1][y + 1][kShift]; }
};

template <typename T>
VDB_DIFFUSE_INLINE void loadHalo(const Topology& topology, const Field<T>& field, size_t b, T outside,
                                 Halo<T>& halo) {
  const T* own = field.block(b);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) std::copy_n(own + x * 64 + y * 8, 8, halo.row(x, y));
  const std::array<int32_t, 6>& near = topology.neighbours(b);
  const auto layer = [&](int face) { return near[face] == kNoBlock ? nullptr : field.block(near[face]); };
  if (const T* n = layer(Topology::kMinusX))
    for (int y = 0; y < 8; ++y) std::copy_n(n + 7 * 64 + y * 8, 8, halo.row(-1, y));
  else
    for (int y = 0; y < 8; ++y) std::fill_n(halo.row(-1, y), 8, outside);
  if (const T* n = layer(Topology::kPlusX))
    for (int y = 0; y < 8; ++y) std::copy_n(n + y * 8, 8, halo.row(8, y));
  else
    for (int y = 0; y < 8; ++y) std::fill_n(halo.row(8, y), 8, outside);
  if (const T* n = layer(Topology::kMinusY))
    for (int x = 0; x < 8; ++x) std::copy_n(n + x * 64 + 7 * 8, 8, halo.row(x, -1));
  else
    for (int x = 0; x < 8; ++x) std::fill_n(halo.row(x, -1), 8, outside);
  if (const T* n = layer(Topology::kPlusY))
    for (int x = 0; x < 8; ++x) std::copy_n(n + x * 64, 8, halo.row(x, 8));
  else
    for (int x = 0; x < 8; ++x) std::fill_n(halo.row(x, 8), 8, outside);
  const T* below = layer(Topology::kMinusZ);
  const T* above = layer(Topology::kPlusZ);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      halo.row(x, y)[-1] = below ? below[x * 64 + y * 8 + 7] : outside;
      halo.row(x, y)[8] = above ? above[x * 64 + y * 8] : outside;
    }
}

/// Conductances of all faces of a block's voxels: x[i] lies between x-1 = i-1 and x = i, and so on.
struct alignas(64) BlockFaces {
  float x[9][8][8];
  float y[8][9][8];
  float z[8][8][16];  // nine are used
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
  zero(Topology::kMinusZ, [&](int x, int y, int z) -> float& { return g.z[x][y][z]; });
  zero(Topology::kPlusZ, [&](int x, int y, int z) -> float& { return g.z[x][y][z + 1]; });
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
        const float* row = r.row(x, y);
        storeRow(g.z[x][y], A.scale[2] / (loadRow(row - 1) + loadRow(row)));
        g.z[x][y][8] = A.scale[2] / (row[7] + row[8]);
      }
    if (!A.cuts.empty()) {
      const auto found = A.cuts.find(static_cast<int32_t>(b));
      if (found != A.cuts.end()) cutBlockFaces(found->second, g);
    }
    return;
  }
  const std::array<int32_t, 6>& near = topology.neighbours(b);
  const int32_t right = near[Topology::kPlusX], back = near[Topology::kPlusY], above = near[Topology::kPlusZ];
  std::copy_n(A.faces[0].block(b), kBlockVoxels, &g.x[0][0][0]);
  if (right != kNoBlock)
    std::copy_n(A.faces[0].block(right), 64, &g.x[8][0][0]);
  else
    std::fill_n(&g.x[8][0][0], 64, 0.0f);
  for (int x = 0; x < 8; ++x) {
    std::copy_n(A.faces[1].block(b) + x * 64, 64, &g.y[x][0][0]);
    if (back != kNoBlock)
      std::copy_n(A.faces[1].block(back) + x * 64, 8, &g.y[x][8][0]);
    else
      std::fill_n(&g.y[x][8][0], 8, 0.0f);
    for (int y = 0; y < 8; ++y) {
      std::copy_n(A.faces[2].block(b) + x * 64 + y * 8, 8, &g.z[x][y][0]);
      g.z[x][y][8] = above != kNoBlock ? A.faces[2].block(above)[x * 64 + y * 8] : 0.0f;
    }
  }
}

/// Sum over faces of g (x_i - x_j) for the eight voxels of a row.
VDB_DIFFUSE_INLINE Row rowOfDifferences(const BlockFaces& g, const Halo<float>& u, int x, int y) {
  const float* own = u.row(x, y);
  const Row c = loadRow(own);
  return loadRow(g.x[x][y]) * (c - loadRow(u.row(x - 1, y))) +
         loadRow(g.x[x + 1][y]) * (c - loadRow(u.row(x + 1, y))) +
         loadRow(g.y[x][y]) * (c - loadRow(u.row(x, y - 1))) +
         loadRow(g.y[x][y + 1]) * (c - loadRow(u.row(x, y + 1))) +
         loadRow(g.z[x][y]) * (c - loadRow(own - 1)) + loadRow(g.z[x][y] + 1) * (c - loadRow(own + 1));
}

/// Sum over faces of g x_j for the eight voxels of a row.
VDB_DIFFUSE_INLINE Row rowOfNeighbours(const BlockFaces& g, const Halo<float>& u, int x, int y) {
  const float* own = u.row(x, y);
  return loadRow(g.x[x][y]) * loadRow(u.row(x - 1, y)) + loadRow(g.x[x + 1][y]) * loadRow(u.row(x + 1, y)) +
         loadRow(g.y[x][y]) * loadRow(u.row(x, y - 1)) + loadRow(g.y[x][y + 1]) * loadRow(u.row(x, y + 1)) +
         loadRow(g.z[x][y]) * loadRow(own - 1) + loadRow(g.z[x][y] + 1) * loadRow(own + 1);
}

/// Sum of the six conductances for the eight voxels of a row.
VDB_DIFFUSE_INLINE Row rowOfConductance(const BlockFaces& g, int x, int y) {
  return loadRow(g.x[x][y]) + loadRow(g.x[x + 1][y]) + loadRow(g.y[x][y]) + loadRow(g.y[x][y + 1]) +
         loadRow(g.z[x][y]) + loadRow(g.z[x][y] + 1);
}

}  // namespace vdb_diffuse
