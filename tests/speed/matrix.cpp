#include "matrix.h"

#include <cmath>

#include "multigrid/block_kernel.h"

namespace vdb_diffuse::speed {
namespace {

void appendRows(const Operator& A, const Field<int32_t>& unknown, size_t b, Matrix& matrix) {
  BlockFaces g;
  Halo<int32_t> index;
  loadFaces(A, b, g);
  loadHalo(*A.topology, unknown, b, -1, index);
  for (int n = 0; n < kBlockVoxels; ++n) {
    if (unknown.block(b)[n] < 0) continue;
    const Coord p = voxelLocal(n);
    const int x = p[0], y = p[1], z = p[2];
    const size_t diagonal = matrix.value.size();
    matrix.column.push_back(unknown.block(b)[n]);
    matrix.value.push_back(A.sink.block(b)[n]);
    const auto join = [&](int j, double conductance) {
      if (j < 0 || conductance == 0) return;
      matrix.value[diagonal] += conductance;
      matrix.column.push_back(j);
      matrix.value.push_back(-conductance);
    };
    join(index.row(x - 1, y)[z], g.x[x][y][z]);
    join(index.row(x + 1, y)[z], g.x[x + 1][y][z]);
    join(index.row(x, y - 1)[z], g.y[x][y][z]);
    join(index.row(x, y + 1)[z], g.y[x][y + 1][z]);
    join(index.at(x, y, z - 1), g.below[x][y][z]);
    join(index.at(x, y, z + 1), g.above[x][y][z]);
    matrix.start.push_back(static_cast<int>(matrix.value.size()));
  }
}

}  // namespace

Matrix assemble(const Operator& A) {
  Matrix matrix;
  Field<int32_t> unknown(*A.topology, -1);
  for (size_t n = 0; n < unknown.size(); ++n)
    if (A.inverse_diagonal[n] > 0) {
      unknown[n] = static_cast<int32_t>(matrix.place.size());
      matrix.place.push_back(n);
    }
  matrix.start.reserve(matrix.rows() + 1);
  matrix.column.reserve(7 * matrix.rows());
  matrix.value.reserve(7 * matrix.rows());
  matrix.start.push_back(0);
  for (size_t b = 0; b < A.topology->blockCount(); ++b) appendRows(A, unknown, b, matrix);
  return matrix;
}

double scaledNorm(const Matrix& matrix, const std::vector<double>& r) {
  double sum = 0;
  for (size_t i = 0; i < matrix.rows(); ++i) sum += r[i] * r[i] / matrix.diagonal(i);
  return std::sqrt(sum);
}

double scaledResidual(const Matrix& matrix, const std::vector<double>& b, const std::vector<double>& x) {
  std::vector<double> r(b);
  for (size_t i = 0; i < matrix.rows(); ++i)
    for (int k = matrix.start[i]; k < matrix.start[i + 1]; ++k) r[i] -= matrix.value[k] * x[matrix.column[k]];
  return scaledNorm(matrix, r) / scaledNorm(matrix, b);
}

}  // namespace vdb_diffuse::speed
