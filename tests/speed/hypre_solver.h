#pragma once

#include <HYPRE.h>
#include <HYPRE_IJ_mv.h>
#include <HYPRE_parcsr_ls.h>

#include <string>

#include "matrix.h"
#include "stopwatch.h"

namespace vdb_diffuse::speed {

/// MPI and hypre, for as long as this lives; one process.
struct HypreSession {
  HypreSession();
  ~HypreSession();
  HypreSession(const HypreSession&) = delete;
};

/// What BoomerAMG is left to choose in a 3-D Poisson-like system. The rest: extended+i interpolation with
/// four entries a row, one sweep of l1-Gauss-Seidel forward before and backward after.
struct HypreOptions {
  enum Coarsening { kPmis = 8, kHmis = 10 };
  Coarsening coarsening = kHmis;
  double strong_threshold = 0.25;
  int aggressive_levels = 0;  ///< levels that are coarsened twice at once

  std::string name() const;
};

struct HypreRun {
  Seconds setup, solve;
  int iterations = 0;
  size_t bytes = 0;  ///< that setup allocated: the coarse matrices, interpolations and vectors
  std::vector<double> x;
};

/// One residual per iteration, from 0 on, of the scaled norm over that of b, and the processor's time until
/// then.
struct HypreHistory {
  Seconds setup;
  std::vector<double> residual, seconds;
  /// Iterations to the tolerance, or -1 if it was not reached.
  int iterationsTo(double tolerance) const;
};

/// Conjugate gradients preconditioned by BoomerAMG in double on one process and thread, from x = 0 (Henson
/// and Yang 2002). Its own stopping norm is another, so it is told the number of iterations instead. It
/// preconditions once more than it iterates, as hypre's does.
class HypreSystem {
 public:
  HypreSystem(const Matrix& matrix, const std::vector<double>& b);
  ~HypreSystem();
  HypreSystem(const HypreSystem&) = delete;

  double secondsAssembly() const { return seconds_assembly_; }
  size_t bytes() const { return bytes_; }  ///< of the matrix and two vectors
  /// Runs once until the tolerance is passed and notes the scaled norm on the way.
  HypreHistory observe(const HypreOptions& options, double tolerance);
  HypreRun run(const HypreOptions& options, int iterations);

 private:
  const Matrix& matrix_;
  double b_norm_;
  HYPRE_IJMatrix matrix_handle_;
  HYPRE_IJVector b_handle_, x_handle_;
  HYPRE_ParCSRMatrix A_;
  HYPRE_ParVector b_, x_;
  double seconds_assembly_ = 0;
  size_t bytes_ = 0;
};

}  // namespace vdb_diffuse::speed
