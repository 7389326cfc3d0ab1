#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace vdb_diffuse {

// How the light that scatters first is spread inside a voxel. A beam that enters a thick voxel scatters near
// the face where it comes in: along an axis, Q ~ exp(k x) with x in voxels, k from the means of the voxels
// beside it.

/// k. The voxels beside may differ because the surface has a step there, and not because the light decays: so
/// it is bounded by twice what the light that travels along the axis loses. \param below, Q, above  means
/// over three voxels in a row;  \param has_below, has_above  whether those are there \param bound  2 tau |Q1
/// / (3 g Q)| along the axis
inline double sourceGrowth(float below, float Q, float above, bool has_below, bool has_above, double bound) {
  const float least = 1e-12f * Q;
  if (!(least > std::numeric_limits<float>::min())) return 0;
  const double high = std::max(above, least), low = std::max(below, least);
  const double k = has_below && has_above ? 0.5 * std::log(high / low)
                   : has_above            ? std::log(high / Q)
                   : has_below            ? std::log(Q / low)
                                          : 0;
  constexpr double kSteepest = 30;
  bound = std::min(bound, kSteepest);
  return std::clamp(k, -bound, bound);
}

/// Slope of the straight line with the mean 1 and the first moment of the exponential, per voxel.
inline double sourceSlope(double k) {
  return std::abs(k) < 0.01 ? k : 12 * (0.5 + 1 / std::expm1(k) - 1 / k);
}

/// What the half voxel before the upper face emits, summed once more on the way to the face: the integral
/// from the centre to the face of the integral from there back to the centre, for the mean 1. The lower face
/// has that of -k.
inline double sourceAhead(double k) {
  return std::abs(k) < 0.01 ? 1.0 / 8 + k / 24 : (0.5 + std::expm1(-0.5 * k) / k) / -std::expm1(-k);
}

}  // namespace vdb_diffuse
