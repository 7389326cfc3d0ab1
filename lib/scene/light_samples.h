#pragma once

#include <vector>

#include "scene/scene.h"

namespace vdb_diffuse {

/// Light from far away in one direction.
struct BeamSample {
  Vec3d direction;           ///< the way it travels, unit length
  Vec3d irradiance;          ///< on a plane that faces it, W/m2
  int index = 0, count = 1;  ///< which of its light's beams this is
};

/// A point that shines. `profile` says how its intensity depends on the angle from `axis`:
/// isotropic: constant; cosine: max(0, cos) (a piece of an area light); spot: 1 inside `cos_inner`, falling
/// smoothly to 0 at `cos_outer`, as Cycles' spot does.
struct PointSample {
  enum class Profile { kIsotropic, kCosine, kSpot };
  Profile profile = Profile::kIsotropic;
  Vec3d position;
  Vec3d axis{0, 0, -1};
  Vec3d intensity;  ///< on the axis, W/sr
  double cos_outer = -1, cos_inner = -1;

  /// Factor 0..1 on `intensity` for light that leaves along `direction` (unit length).
  double falloff(const Vec3d& direction) const;
};

/// A scene's lights as a sum of beams and points: quadrature nodes whose powers add up to the lights'.
struct LightSamples {
  std::vector<BeamSample> beams;
  std::vector<PointSample> points;
};

struct LightSampling {
  int dome_directions = 64;  ///< per dome light; an image spends them where it is bright
  int sun_directions = 16;   ///< over the disc of a sun wider than `sharp_sun`
  int ball_points = 16;      ///< on a point light with a radius
  int area_points = 64;      ///< per area light, shared out by area
  double sharp_sun = 0.02;   ///< radians: a sun narrower than this is one direction
};

/// Deterministic. Lights of zero power give no samples.
LightSamples sampleLights(const Scene& scene, const LightSampling& settings = {});

/// Radiance of a dome light that arrives travelling along `direction` (unit length). An image is constant in
/// each pixel, so that its integral is a sum; dome_samples.cpp draws where the pixels lie.
Vec3d domeRadiance(const DomeLight& dome, const Vec3d& direction);

/// n directions spread evenly over the sphere (a spherical Fibonacci lattice), equal weights.
std::vector<Vec3d> sphereDirections(int n);

}  // namespace vdb_diffuse
