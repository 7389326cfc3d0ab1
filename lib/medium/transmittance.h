#pragma once

#include <cmath>
#include <limits>

#include "medium/medium.h"

namespace vdb_diffuse {

/// Integral of the density along a ray, exact for constant voxels, in density times the unit of t.
/// \param p, d       origin and direction in index space
/// \param t0, t1     the part of the ray that counts
/// \param enough     the march ends once the integral exceeds this
double columnDensity(const Volume& density, const Vec3d& p, const Vec3d& d, double t0, double t1,
                     double enough = std::numeric_limits<double>::infinity());

/// Mean of exp(-tau) while tau runs from `before` to `before + inside`: what a voxel of optical depth
/// `inside` sees of a beam that has passed `before`. Exact down to inside = 0.
inline double beamAverage(double before, double inside) {
  return std::exp(-before) * (inside > 1e-8 ? -std::expm1(-inside) / inside : 1 - 0.5 * inside);
}

/// Optical depth after which light counts as gone: exp(-40) is 4e-18, below any float beside the rest.
constexpr double kOpaque = 40;

}  // namespace vdb_diffuse
