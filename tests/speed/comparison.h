#pragma once

#include <string>

#include "cloud_system.h"

namespace vdb_diffuse::speed {

struct ComparisonSettings {
  std::vector<double> tolerances{1e-3, 1e-4, 1e-6};
  int repeats = 4;           ///< even, so that either solver goes first as often
  bool all_threads = false;  ///< our solver once more on all threads
  bool hypre = true, pcg = true;
};

/// One solver at one tolerance; times are medians in ns per active voxel.
struct SolverTime {
  std::string solver;
  int threads = 1;
  double tolerance = 0;
  int iterations = 0;
  double setup = 0, solve = 0, total = 0;
  double cpu = 0;              ///< processor's time of setup and solve together
  double bytes_per_voxel = 0;  ///< of hierarchy and operator, without CG's own vectors
  double residual = 0;         ///< true, scaled, formed in double from the assembled matrix
  double error = 0;            ///< largest over the largest value, against hypre at 1e-10 if it runs
};

struct Comparison {
  size_t voxels = 0;
  double fill = 0, cap = 0;
  double equation = 0, assembly = 0;  ///< ns per voxel, in no total: A from the density, hypre's copy of A
  std::vector<std::string> tried;     ///< hypre's options, a line each
  std::vector<SolverTime> times;
  struct Ratio {
    std::string peer;
    double tolerance, median, lowest, highest;  ///< the peer's time over ours, of neighbouring runs
    double cpu;                                 ///< the same of the processor's time, median
    double difference;                          ///< largest between the two solutions over the largest value
  };
  std::vector<Ratio> ratios;
};

/// The solvers on one system, on one thread unless said otherwise, taking turns in who goes first. Of the
/// options that are tried on hypre each tolerance gets those that took least of the processor's time to it.
Comparison compareSolvers(const CloudSystem& system, const ComparisonSettings& settings);

/// Our iterations to the tolerance, or -1.
int countIterations(const CloudSystem& system, double tolerance);

}  // namespace vdb_diffuse::speed
