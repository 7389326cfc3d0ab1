#pragma once

#include <string>
#include <vector>

namespace vdb_diffuse::speed {

/// One step of a bake on one number of threads.
struct PhaseTime {
  std::string name;
  int threads = 1;
  double ns = 0;     ///< per active voxel, median
  double bytes = 0;  ///< that the step has to move per active voxel, each field once per pass; 0: not counted
};

/// The steps of a bake of one cloud.
struct Phases {
  size_t voxels = 0;
  double fill = 0;  ///< fraction of the stored voxels that are active
  std::vector<PhaseTime> times;
};

struct PhaseSettings {
  int repeats = 3;
  std::vector<int> threads{1};
  std::vector<double> tolerances{1e-3, 1e-4, 1e-6};
};

/// Reading and writing beside OpenVDB's own file calls on the same grids, topology, first scatter of an
/// oblique sun, equation and hierarchy, one V-cycle, solves, and one direction of a transport sweep.
Phases timePhases(size_t voxels, const PhaseSettings& settings);

}  // namespace vdb_diffuse::speed
