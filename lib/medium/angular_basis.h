#pragma once

#include <openvdb/Types.h>

#include <cmath>

namespace vdb_diffuse {

/// Real spherical harmonics of the first orders as polynomials of a unit vector, normalised so that the mean
/// over the sphere of b_i b_j is 1 for i = j and 0 otherwise. Then a phase function with Legendre moments p_l
/// (p_0 = 1, p_1 = g) scatters light with the moments m_k = mean of b_k I into sum over k of p_l(k) m_k
/// b_k(s). Order 1 is sqrt(3) s. Place 0, the constant 1, is left out: place k is k-1 here.
constexpr int kFirstOrder = 3, kSecondOrder = 8;  ///< how many functions up to that order

inline int orderOf(int k) {
  return k < kFirstOrder ? 1 : 2;
}

inline void angularBasis(const openvdb::Vec3d& s, double b[kSecondOrder]) {
  const double three = std::sqrt(3.0), fifteen = std::sqrt(15.0);
  for (int a = 0; a < 3; ++a) b[a] = three * s[a];
  b[3] = fifteen * s[0] * s[1];
  b[4] = fifteen * s[1] * s[2];
  b[5] = fifteen * s[2] * s[0];
  b[6] = 0.5 * fifteen * (s[0] * s[0] - s[1] * s[1]);
  b[7] = 0.5 * std::sqrt(5.0) * (3 * s[2] * s[2] - 1);
}

}  // namespace vdb_diffuse
