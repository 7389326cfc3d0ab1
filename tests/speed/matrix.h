#pragma once

#include <vector>

#include "multigrid/operator.h"

namespace vdb_diffuse::speed {

/// The finest operator as a sparse matrix in double, row by row, over the voxels that have an equation. Its
/// entries are sums of the operator's own float conductances, so that both solvers see the same numbers, and
/// its residuals owe nothing to the solver's kernels.
struct Matrix {
  std::vector<size_t> place;  ///< of each unknown in a field
  std::vector<int> start;     ///< of each row in `column` and `value`, and the end
  std::vector<int> column;    ///< a row's first entry is its diagonal
  std::vector<double> value;

  size_t rows() const { return place.size(); }
  double diagonal(size_t i) const { return value[start[i]]; }
};

Matrix assemble(const Operator& A);

template <typename T>
std::vector<double> gather(const Matrix& matrix, const Field<T>& field) {
  std::vector<double> values;
  values.reserve(matrix.rows());
  for (size_t n : matrix.place) values.push_back(field[n]);
  return values;
}

/// ||D^-1/2 r||, D = diag A.
double scaledNorm(const Matrix& matrix, const std::vector<double>& r);

/// ||D^-1/2 (b - A x)|| / ||D^-1/2 b||
double scaledResidual(const Matrix& matrix, const std::vector<double>& b, const std::vector<double>& x);

}  // namespace vdb_diffuse::speed
