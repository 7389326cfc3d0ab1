#pragma once

#include "matrix.h"
#include "stopwatch.h"

namespace vdb_diffuse::speed {

struct PcgRun {
  Seconds setup, solve;  ///< of the scaled matrix and its factors; of the iterations
  int iterations = 0;
  size_t bytes = 0;  ///< of matrix, factors and the four vectors
  std::vector<double> x;
};

/// OpenVDB's own conjugate gradients with its incomplete Cholesky factors, in double, on the system scaled
/// to a unit diagonal, without which it stops early. It watches the largest entry of the residual, so it is
/// told a bound that `boundFor` has found to reach the tolerance in our norm.
PcgRun runPcg(const Matrix& matrix, const std::vector<double>& b, double bound, int threads);

/// Halves the bound until the scaled residual is at most the tolerance.
double boundFor(const Matrix& matrix, const std::vector<double>& b, double tolerance);

}  // namespace vdb_diffuse::speed
