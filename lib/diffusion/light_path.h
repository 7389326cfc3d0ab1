#pragma once

#include <cmath>

#include "medium/transmittance.h"
#include "scene/light_samples.h"
#include "scene/occluder.h"

namespace vdb_diffuse {

/// Mean of 1/r^2 over a ball of radius a whose centre lies at distance r: the falloff of a point light seen
/// by a voxel, finite inside it (3/a^2 at its centre) and 1/r^2 far away.
inline double meanInverseSquare(double r, double a) {
  const double ratio = r / a;
  if (ratio > 20) return 1 / (r * r);  // the next term is (a/r)^2 / 5 of it
  if (ratio < 1e-3) return 3 / (a * a);
  if (std::abs(ratio - 1) < 1e-9) return 1.5 / (a * a);
  return 1.5 / (a * a) *
         (1 + (1 - ratio * ratio) / (2 * ratio) * std::log(std::abs((1 + ratio) / (1 - ratio))));
}

/// Distance along d (index space per unit t) from p to the side of the voxel about `centre` where it leaves.
inline double exitOfVoxel(const Vec3d& p, const Vec3d& d, const Vec3d& centre) {
  double t = std::numeric_limits<double>::infinity();
  for (int a = 0; a < 3; ++a) {
    if (d[a] == 0) continue;
    t = std::min(t, (centre[a] + (d[a] > 0 ? 0.5 : -0.5) - p[a]) / d[a]);
  }
  return std::max(t, 0.0);
}

/// What light passes on its way to a point of a voxel: column densities in density x world length.
struct LightPath {
  double before = 0;  ///< up to where it enters the voxel
  double inside = 0;  ///< the voxel's chord
};

/// The path of light that reaches p_index against `toward` (unit world vector to the light) over `distance`.
inline LightPath lightPath(const Volume& density, float rho, const Vec3d& p_index, const Vec3d& centre,
                           const Vec3d& toward, double distance, double enough) {
  const Vec3d d = density.transform.directionToIndex(toward);
  const double ahead = exitOfVoxel(p_index, d, centre), behind = exitOfVoxel(p_index, -d, centre);
  LightPath path;
  path.inside = rho * (std::min(ahead, distance) + behind);
  path.before = columnDensity(density, p_index, d, ahead, distance, enough);
  return path;
}

}  // namespace vdb_diffuse
