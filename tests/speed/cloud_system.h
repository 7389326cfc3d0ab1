#pragma once

#include "diffusion/equation.h"

namespace vdb_diffuse::speed {

/// The equation of a made cloud (shapes/cloud.h) of albedo 1, lit by a sun from above, as a bake with the
/// default model solves it: what returns of the light that leaves is held back, which makes the system harder
/// (14 iterations to 1e-6 instead of 9 for 2 M voxels). With the mean-free-path cap or, `raw`, without it.
struct CloudSystem {
  Medium medium;
  Equation equation;
  Field<float> b;
  double seconds_equation = 0;  ///< to form A from the density

  size_t voxels() const { return medium.topology().activeVoxelCount(); }
  /// Fraction of the stored voxels that are active.
  double fill() const;
};

/// The equation's factors of returned light, without surfaces.
Field<float> returnedLight(const Medium& medium, const ChannelOptics& optics);

CloudSystem makeCloudSystem(size_t voxels, bool raw);

}  // namespace vdb_diffuse::speed
