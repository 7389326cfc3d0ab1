#pragma once

#include <vector>

#include "grid/progress.h"
#include "multigrid/cycle.h"

namespace vdb_diffuse {

struct SolveSettings {
  double tolerance = 1e-4;  ///< on the diagonally scaled norm of the residual over that of b, > 0
  double balance = 0;       ///< if > 0, also on |sum of residuals| / |sum of b|, the energy's closure
  int max_iterations = 2000;
  Progress progress;  ///< told the logarithm of the residual's fall, as a fraction
};

struct SolveReport {
  bool converged = false;
  int iterations = 0;
  double relative_residual = 0;  ///< of the true residual, formed in double at the end
  double balance = 0;            ///< |sum of residuals| / |sum of b|
  std::vector<double> residual;  ///< relative, by iteration, as the recurrence has it
};

/// Conjugate gradients on A x = b, preconditioned by a V-cycle. Stops on the scaled norm
/// ||D^-1/2 (b - A x)|| / ||D^-1/2 b||, D = diag A. The recurrence runs in float; x and the true residual,
/// which replaces the recurrence's until it passes too, are double: a float x cannot hold a residual that is
/// 1e-6 of b where x is large and smooth. A zero b gives x = 0 and no iterations.
///
/// \param x  in: the start (zero or better); out: the solution; 0 in inactive voxels
SolveReport solve(Multigrid& multigrid, const Field<float>& b, Field<double>& x,
                  const SolveSettings& settings = {});

}  // namespace vdb_diffuse
