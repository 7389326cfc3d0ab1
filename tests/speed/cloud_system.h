#pragma once

#include "diffusion/equation.h"

namespace vdb_diffuse::speed {

/// The equation of a made cloud (shapes/cloud.h) of albedo 1, lit by a sun from above, as the default model
/// has it; with the mean-free-path cap or, `raw`, without it.
struct CloudSystem {
  Medium medium;
  Equation equation;
  Field<float> b;
  double seconds_equation = 0;  ///< to form A from the density

  size_t voxels() const { return medium.topology().activeVoxelCount(); }
  /// Fraction of the stored voxels that are active.
  double fill() const;
};

CloudSystem makeCloudSystem(size_t voxels, bool raw);

}  // namespace vdb_diffuse::speed
