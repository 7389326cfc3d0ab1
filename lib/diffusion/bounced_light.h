#pragma once

#include <functional>
#include <memory>

#include "diffusion/beam_medium.h"
#include "surfaces/surface_point.h"

namespace vdb_diffuse {

/// What surfaces get from each other of the light of the lights, after any number of bounces. With L the
/// radiance that a surface throws back of the lights' own light, R its albedo and T the transmittance,
///
///     E(x) = int T(x,y) ( L(y) + R(y) E(y) / pi ) cos dw      y: the surface that x sees along w
///
///        y ------ wall          E is kept by patches, the cells of surface_cells.h that the volume can see
///       / \                     and those that these can see. One point of each looks around, along
///      /   \  T                 directions that stand for equal parts of cos dw; the sums are then iterated,
///     x     x'  ground          one bounce at a time (radiosity; Goral et al. 1984).
///
/// Patches grow with the distance from the volume and not with its resolution, and a surface that sees no
/// other adds rays that meet nothing. Foliage has more sides than patches are kept for: they grow there, and
/// a side that no patch stands for takes the light of one nearby.
class BouncedLight {
 public:
  /// Radiance of the lights' own light that leaves a surface toward a ray that met it.
  using Lit =
      std::function<TwofoldLight(const Occluder::Hit& hit, const Vec3d& origin, const Vec3d& direction)>;

  /// \param lit  called from many threads; not kept. All references must outlive the object
  BouncedLight(const BeamMedium& medium, const std::vector<Surface>& surfaces, const Occluder& occluder,
               const Lit& lit);
  ~BouncedLight();

  /// W/m2 at a point of a triangle. The same bits for any number of threads.
  TwofoldLight irradiance(int surface, uint32_t triangle, bool front, const SurfacePoint& at) const;
  /// How many times light was sent on; 0 where no surface sees another.
  int bounces() const;
  size_t patches() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vdb_diffuse
