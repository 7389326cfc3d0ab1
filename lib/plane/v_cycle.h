#pragma once

#include "grid/progress.h"
#include "plane/plane_equation.h"

namespace vdb_diffuse {

/// The multi-grid scheme of Stam (1995) section 4.1 in the plane: relax, go on to the next coarser grid with
/// what is left, come back, relax. The printed stencil is neither conservative nor dimensionally possible;
/// faces conduct by the resistances of plane_equation.h, on coarse grids with the mean resistance of the
/// cells beneath.
struct VCycleSettings {
  int relaxations = 3;      ///< on each grid on the way down, and again on the way up; section 5.1 has 3
  int depth = 0;            ///< grids; section 5.1 has 5; 0: as many as can be halved; 1: relaxation alone
  double tolerance = 1e-6;  ///< on ||A_ii^-1/2 (b - A x)|| / ||A_ii^-1/2 b||
  int max_cycles = 1000;
  double max_seconds = std::numeric_limits<double>::infinity();
  Progress progress;
};

struct VCycleReport {
  bool converged = false;
  int grids = 0;                 ///< that there were
  std::vector<double> residual;  ///< before the first cycle and after each, relative
  std::vector<double> seconds;   ///< since the start, likewise
  std::vector<int> visits;       ///< of the first cycle: the grid of every relaxation, 0 the finest
  double work = 0;               ///< relaxations of one cycle, in those of the finest grid
};

/// Solves A x = b from x = 0.
VCycleReport solveByVCycles(const PlaneSystem& system, PlaneField& x, const VCycleSettings& settings = {});

/// y = A x.
void applyPlane(const PlaneOperator& A, const PlaneField& x, PlaneField& y);

}  // namespace vdb_diffuse
