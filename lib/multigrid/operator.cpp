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
      const double *c = u.row(i, j), *xl = u.row(i - 1, j), *xh = u.row(i + 1, j), *yl = u.row(i, j - 1),
                   *yh = u.row(i, j + 1);
      const float *gx = g.x[i][j], *gX = g.x[i + 1][j], *gy = g.y[i][j], *gY = g.y[i][j + 1],
                  *gz = g.below[i][j], *gZ = g.above[i][j];
      const int n = voxelOffset(i, j, 0);
      for (int k = 0; k < 8; ++k) {
        const double flow = gx[k] * (c[k] - xl[k]) + gX[k] * (c[k] - xh[k]) + gy[k] * (c[k] - yl[k]) +
                            gY[k] * (c[k] - yh[k]) + gz[k] * (c[k] - u.at(i, j, k - 1)) +
                            gZ[k] * (c[k] - u.at(i, j, k + 1));
        out[n + k] = static_cast<float>(rhs[n + k] - (flow + sink[n + k] * c[k]));
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
