#pragma once

#include <memory>

#include "diffusion/bounced_light.h"
#include "scene/light_samples.h"

namespace vdb_diffuse {

/// Light that surfaces throw back into the medium, Lambertian. Its radiance follows from the irradiance of
/// the lights through the medium, computed where it is first asked for on a lattice in the plane of each
/// triangle (cells grow with the distance from the volume) and kept, and from what surfaces send each other
/// (bounced_light.h).
class ReflectedLight {
 public:
  /// All references must outlive the object.
  ReflectedLight(const BeamMedium& medium, const LightSamples& lights, const std::vector<Surface>& surfaces,
                 const Occluder& occluder);
  ~ReflectedLight();

  /// True where some surface has an albedo and some light shines.
  bool any() const;
  using Radiance = TwofoldLight;  ///< W/m2/sr
  /// Radiance that leaves a surface toward a ray that met it. `hit` came from
  /// `occluder.closest(origin, direction, ...)`. The same for every caller, thread and order of calls.
  Radiance radiance(const Occluder::Hit& hit, const Vec3d& origin, const Vec3d& direction) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vdb_diffuse
