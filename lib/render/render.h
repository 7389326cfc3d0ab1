#pragma once

#include <vector>

#include "grid/progress.h"
#include "render/camera.h"
#include "render/emission.h"
#include "scene/scene.h"

namespace vdb_diffuse {

struct RenderSettings {
  int samples = 2;          ///< rays per pixel and axis, stratified and jittered: samples^2 in all, >= 1
  uint32_t seed = 0;        ///< of the jitter, which depends on it and on the pixel alone
  bool interpolate = true;  ///< trilinear between voxel centres; else each voxel is constant
};

/// What comes from the volume, and how much of what is behind it comes through.
struct Picture {
  Image radiance;                    ///< W/m2/sr
  std::vector<Vec3f> transmittance;  ///< per pixel, 0..1
};

/// Integrates along each ray, away from the camera,
///
///     L = int T(t) e(t) dt,   T(t) = exp( -int_0^t sigma_t rho ds ),   e = `emittedToward` the camera.
///
/// Between voxel centres both rho and e are trilinear, so that the light sent per unit of matter needs no
/// value where there is none. A cell's optical depth is by two Gauss points, exact for the cubic that a
/// trilinear function is along a ray; each half then has the closed form for constant rho and e. A ray ends
/// where less than 1e-4 comes through. Parallel over tiles; the result does not depend on the number of
/// threads.
Picture render(const LitVolume& lit, const Camera& camera, const RenderSettings& settings = {},
               const Progress& progress = {});

/// The picture before a background of constant radiance.
Image over(const Picture& picture, const Vec3d& background);
/// 1 - transmittance, mean over the channels.
std::vector<float> opacity(const Picture& picture);

/// Stops that bring the 99th percentile of the luminance, among pixels that have any, to 0.8 of white. 0 for
/// a black picture.
double automaticExposure(const Image& image);

}  // namespace vdb_diffuse
