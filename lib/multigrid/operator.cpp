#include "multigrid/operator.h"

#include "multigrid/block_kernel.h"

namespace vdb_diffuse {
namespace {

VDB_DIFFUSE_KERNEL void formDiagonalOfBlock(Operator& A, size_t b) {
  BlockFaces g;
  loadFaces(A, b, g);
  const float* sink = A.sink.block(b);
  float* inverse = A.inverse_diagonal.block(b);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      const int n = voxelOffset(x, y, 0);
      const Row diagonal = rowOfConductance(g, x, y) + loadRow(sink + n);
      for (int z = 0; z < 8; ++z) inverse[n + z] = diagonal[z] > 0 ? 1 / diagonal[z] : 0.0f;
    }
}

VDB_DIFFUSE_KERNEL double applyToBlock(const Operator& A, const Field<float>& p, Field<float>& q, size_t b) {
  const float* sink = A.sink.block(b);
  float* out = q.block(b);
  prefetchBlock(p.block(b));
  prefetchBlock(sink);
  BlockFaces g;
  Halo<float> u;
  loadFaces(A, b, g);
  loadHalo(*A.topology, p, b, 0.0f, u);
  DoubleRow dot = {};
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      const int n = voxelOffset(x, y, 0);
      const Row own = loadRow(u.row(x, y));
      const Row value = rowOfDifferences(g, u, x, y) + loadRow(sink + n) * own;
      storeRow(out + n, value);
      dot += widen(value) * widen(own);
    }
  return sumOf(dot);
}

using FourDoubles = DoubleRow::Half;
using FourPlaces = int64_t __attribute__((vector_size(32)));

/// The values one voxel below and one above along z, in a row that goes on with `beyond`.
VDB_DIFFUSE_INLINE DoubleRow fromBelow(const DoubleRow& row, double beyond) {
  return {__builtin_shuffle(row.low, FourDoubles{} + beyond, FourPlaces{4, 0, 1, 2}),
          __builtin_shuffle(row.low, row.high, FourPlaces{3, 4, 5, 6})};
}
VDB_DIFFUSE_INLINE DoubleRow fromAbove(const DoubleRow& row, double beyond) {
  return {__builtin_shuffle(row.low, row.high, FourPlaces{1, 2, 3, 4}),
          __builtin_shuffle(row.high, FourDoubles{} + beyond, FourPlaces{1, 2, 3, 4})};
}

VDB_DIFFUSE_KERNEL void residualOfBlock(const Operator& A, const Field<float>& b, const Field<double>& x,
                                        Field<float>& r, size_t block) {
  BlockFaces g;
  Halo<double> u;
  loadFaces(A, block, g);
  loadHalo(*A.topology, x, block, 0.0, u);
  const float *sink = A.sink.block(block), *rhs = b.block(block);
  float* out = r.block(block);
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j) {
      const int n = voxelOffset(i, j, 0);
      const DoubleRow c = loadDoubles(u.row(i, j));
      DoubleRow left = widen(loadRow(rhs + n));
      const auto flow = [&](const float* conductance, const DoubleRow& next) VDB_DIFFUSE_INLINED {
        const DoubleRow w = widen(loadRow(conductance));
        left.low -= w.low * (c.low - next.low);
        left.high -= w.high * (c.high - next.high);
      };
      flow(g.x[i][j], loadDoubles(u.row(i - 1, j)));
      flow(g.x[i + 1][j], loadDoubles(u.row(i + 1, j)));
      flow(g.y[i][j], loadDoubles(u.row(i, j - 1)));
      flow(g.y[i][j + 1], loadDoubles(u.row(i, j + 1)));
      flow(g.below[i][j], fromBelow(c, u.below[i][j]));
      flow(g.above[i][j], fromAbove(c, u.above[i][j]));
      flow(sink + n, DoubleRow{});
      for (int k = 0; k < 4; ++k) {
        out[n + k] = static_cast<float>(left.low[k]);
        out[n + 4 + k] = static_cast<float>(left.high[k]);
      }
    }
}

VDB_DIFFUSE_KERNEL double dotOfBlock(const float* a, const float* b) {
  DoubleRow sum = {};
  for (int n = 0; n < kBlockVoxels; n += 8) sum += widen(loadRow(a + n)) * widen(loadRow(b + n));
  return sumOf(sum);
}

VDB_DIFFUSE_KERNEL double scaledNormOfBlock(const float* r, const float* inverse) {
  DoubleRow sum = {};
  for (int n = 0; n < kBlockVoxels; n += 8) {
    const DoubleRow value = widen(loadRow(r + n));
    sum += value * value * widen(loadRow(inverse + n));
  }
  return sumOf(sum);
}

}  // namespace

void formDiagonal(Operator& A) {
  A.inverse_diagonal = Field<float>(*A.topology);
  forEachBlock(A.topology->blockCount(), [&](size_t b) { formDiagonalOfBlock(A, b); });
}

double apply(const Operator& A, const Field<float>& p, Field<float>& q) {
  return sumOverBlocks<double>(A.topology->blockCount(), [&](size_t b) { return applyToBlock(A, p, q, b); });
}

void residual(const Operator& A, const Field<float>& b, const Field<double>& x, Field<float>& r) {
  forEachBlock(A.topology->blockCount(), [&](size_t block) { residualOfBlock(A, b, x, r, block); });
}

double dot(const Field<float>& a, const Field<float>& b) {
  return sumOverBlocks<double>(a.blockCount(),
                               [&](size_t block) { return dotOfBlock(a.block(block), b.block(block)); });
}

double scaledNormSquared(const Operator& A, const Field<float>& r) {
  return sumOverBlocks<double>(A.topology->blockCount(), [&](size_t b) {
    return scaledNormOfBlock(r.block(b), A.inverse_diagonal.block(b));
  });
}

}  // namespace vdb_diffuse
