#pragma once

#include <cmath>

namespace vdb_diffuse {

// Where in a voxel a beam scatters: one that enters a thick voxel does so near the face where it comes in.

/// Means over 0 <= t <= 1 of exp(-tau t), t exp(-tau t) and t^2 exp(-tau t), tau >= 0.
struct DecayMoments {
  double m0, m1, m2;
};

inline DecayMoments decayMoments(double tau) {
  if (tau > 0.5) {
    const double e = std::exp(-tau), m0 = (1 - e) / tau, m1 = (m0 - e) / tau;
    return {m0, m1, (2 * m1 - e) / tau};
  }
  DecayMoments sum{0, 0, 0};
  double term = 1;  // (-tau)^n / n!; what is left out is below 1e-12
  for (int n = 0; n < 11; ++n) {
    sum.m0 += term / (n + 1);
    sum.m1 += term / (n + 2);
    sum.m2 += term / (n + 3);
    term *= -tau / (n + 1);
  }
  return sum;
}

/// First moment about the centre of a beam of mean 1 that travels up through a voxel of the optical depth
/// tau, whose sides it enters at the same height: exp(-tau x). -tau/12 for small tau, -1/2 for large; odd.
inline double beamLean(double tau) {
  if (std::abs(tau) < 0.01) return -tau / 12;
  return -(0.5 + 1 / std::expm1(tau) - 1 / tau);
}

}  // namespace vdb_diffuse
