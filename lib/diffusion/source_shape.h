#pragma once

#include <cmath>

namespace vdb_diffuse {

// How the light that scatters first is spread inside a voxel: a beam that enters a thick one scatters near
// the face where it comes in. Along an axis that it travels up, Q ~ exp(-tau x), x in voxels. What follows is
// for a beam of mean 1; all of it is odd in the direction, so that beams add up as their vector means do.

/// The half voxel before the upper face emits less than the one before the lower face: half the difference of
/// their first moments about the centre. (The flux at x lacks what starts between there and the face; summed
/// over the way from the centre, what starts at x is missing on all of the way up to x.) -tau/24 for small
/// tau.
inline double beamAhead(double tau) {
  if (tau < 0.01) return -tau / 24;
  const double up = (0.5 + std::expm1(0.5 * tau) / -tau) / -std::expm1(tau);
  const double down = (0.5 + std::expm1(-0.5 * tau) / tau) / -std::expm1(-tau);
  return 0.5 * (up - down);
}

/// Slope per voxel of the straight line with the same first moment. -tau for small tau, -6 for large.
inline double beamSlope(double tau) {
  return tau < 0.01 ? -tau : -12 * (0.5 + 1 / std::expm1(tau) - 1 / tau);
}

/// I0 bends where the beam scatters, I0'' = -2 r S: the slope of the straight line with its first moment,
/// less that of the line between its faces, over 2 r S. -tau^2/60 over tau for small tau.
inline double beamBend(double tau) {
  return tau < 0.05 ? -tau / 60 : (-tau - beamSlope(tau)) / (tau * tau);
}

}  // namespace vdb_diffuse
