#include "pcg_solver.h"

#include <openvdb/math/ConjGradient.h>
#include <openvdb/util/NullInterrupter.h>
#include <tbb/global_control.h>

#include <cmath>

namespace vdb_diffuse::speed {
namespace {

namespace pcg = openvdb::math::pcg;
using Stencil = pcg::SparseStencilMatrix<double, 7>;

}  // namespace

PcgRun runPcg(const Matrix& matrix, const std::vector<double>& b, double bound, int threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  PcgRun run;
  const Stopwatch setup_watch;
  const auto size = static_cast<pcg::SizeType>(matrix.rows());
  std::vector<double> scale(matrix.rows());
  for (size_t i = 0; i < matrix.rows(); ++i) scale[i] = 1 / std::sqrt(matrix.diagonal(i));
  Stencil A(size);
  for (size_t i = 0; i < matrix.rows(); ++i)
    for (int k = matrix.start[i]; k < matrix.start[i + 1]; ++k) {
      const int j = matrix.column[k];
      A.setValue(static_cast<pcg::SizeType>(i), static_cast<pcg::SizeType>(j),
                 matrix.value[k] * scale[i] * scale[j]);
    }
  pcg::IncompleteCholeskyPreconditioner<Stencil> factors(A);
  run.setup = setup_watch.read();

  const Stopwatch solve_watch;
  pcg::Vector<double> rhs(size), x(size, 0.0);
  for (size_t i = 0; i < matrix.rows(); ++i) rhs[static_cast<pcg::SizeType>(i)] = b[i] * scale[i];
  pcg::State stop = pcg::terminationDefaults<double>();
  stop.iterations = 20000;
  stop.relativeError = bound;
  stop.absoluteError = 0;
  openvdb::util::NullInterrupter nobody;
  run.iterations = pcg::solve(A, rhs, x, factors, nobody, stop).iterations;
  run.solve = solve_watch.read();
  for (size_t i = 0; i < matrix.rows(); ++i) run.x.push_back(x[static_cast<pcg::SizeType>(i)] * scale[i]);
  constexpr size_t kRow = 7 * (sizeof(double) + sizeof(pcg::SizeType)) + sizeof(pcg::SizeType);
  run.bytes = matrix.rows() * (2 * kRow + 6 * sizeof(double));
  return run;
}

double boundFor(const Matrix& matrix, const std::vector<double>& b, double tolerance) {
  constexpr int kMostTrials = 8;
  double bound = tolerance;
  for (int n = 0; n < kMostTrials; ++n, bound /= 2)
    if (scaledResidual(matrix, b, runPcg(matrix, b, bound, 1).x) <= tolerance) break;
  return bound;
}

}  // namespace vdb_diffuse::speed
