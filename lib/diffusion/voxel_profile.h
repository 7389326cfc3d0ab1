#pragma once

#include <algorithm>
#include <cmath>

namespace vdb_diffuse {

/// How the diffuse light runs inside one voxel, from its mean to its faces. Along an axis
///
///     -D I0'' + tau_a I0 = S(x),     -1/2 < x < 1/2 in voxels,   r = 1/(2D)
///
/// is solved exactly by I0 = particular + A cosh(k x) + B sinh(k x), k^2 = 2 r tau_a, so that the value on
/// the upper face is
///
///     I_face = a Ibar - r_odd F + integral of v(x) S(x),     v = (2 r a / k^2) (cosh k(x + 1/2) - 1)
///
/// with Ibar the mean, F the flux out through that face, a = k / sinh k and r_odd = r tanh(k/2) / (k/2). For
/// v stands a parabola c (x - x0)^2 with the mean of v and its value r_odd on the face, as far as there is
/// one that is nowhere negative, so that the integral becomes
///
///     r ( even S0 + lean S1 + spread S2 ),
///
/// S0 the mean of S, S1 its first moment and S2 its second less S0/12; S1 changes sign for the lower face.
/// Without absorption a = odd = lean = spread = 1 and even = 1/3, and all of this is exact.
struct VoxelProfile {
  double r;                   ///< half resistance 1/(2D), in mean voxel sizes
  double a;                   ///< the unknown of the linear system is a times the mean
  double odd;                 ///< r_odd / r
  double even, lean, spread;  ///< see above
  double slope;  ///< of the straight line with the first moment of I0, over -r (F_below + F_above)
};

/// A voxel that light crosses in more decay lengths passes none on: its mean is what its own source makes it.
constexpr double kMostDecay = 12;

/// Below this k^2 the first terms of the series in it do, for rows of voxels at once as well: what is left
/// out is below 1e-4. Number is what T is made of.
constexpr double kSmallDecay = 1e-3;
template <typename Number, typename T>
inline T thinOneLessA(T k2) {
  return k2 * Number(1. / 6);
}
template <typename Number, typename T>
inline T thinEven(T k2) {
  return Number(1. / 3) - k2 * Number(7. / 180);
}

inline VoxelProfile voxelProfile(double r, double tau_a) {
  const double k2 = 2 * r * tau_a;
  if (k2 < kSmallDecay)
    return {r, 1 - thinOneLessA<double>(k2), 1 - k2 / 12, thinEven<double>(k2), 1, 1, 1 - k2 / 10};
  const double k = std::sqrt(k2), seen = std::min(k, kMostDecay);
  VoxelProfile p;
  p.r = r;
  p.a = seen / std::sinh(seen);
  p.odd = std::tanh(0.5 * k) / (0.5 * k);
  p.even = 2 * (1 - p.a) / k2;
  // c (x0^2 + 1/12) = even and c (1/2 - x0)^2 = odd; their quotient is 1/4 at least, with x0 = -1/6
  const double q = p.even / p.odd, least = 0.25;
  const double x0 = q > least ? -(q + std::sqrt(q * q - (1 - q) * (1. / 3 - q))) / (2 * (1 - q)) : -1. / 6;
  p.spread = p.even / (x0 * x0 + 1. / 12);
  p.lean = -2 * x0 * p.spread;
  p.slope = 12 * (1 - p.odd) / k2;
  return p;
}

/// A voxel whose unknown is its centre value, with all that happens in it happening there.
inline VoxelProfile flatProfile(double r) {
  return {r, 1, 1, 0, 0, 0, 1};
}

/// A first moment S1 of the source bends I0: the slope of the straight line with its first moment is r times
/// this times S1 steeper than the flux through the faces says. Exact for a source that is linear in the voxel
/// of a medium that does not absorb.
inline double bendOfProfile(const VoxelProfile& p) {
  return 2.4 * p.slope;
}

}  // namespace vdb_diffuse
