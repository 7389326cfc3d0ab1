#pragma once

#include <cmath>
#include <cstdint>

#include "grid/transform.h"

namespace vdb_diffuse {

using openvdb::Vec3f;

/// Random numbers of one path: xoroshiro128++ (Blackman and Vigna, 2019), whose state is hashed from the
/// seed and the path's number, so that a path's numbers do not depend on who computes it, or when.
class RandomStream {
 public:
  RandomStream(uint64_t seed, uint64_t batch, uint64_t path)
      : RandomStream(mixed(mixed(seed + 0x9E3779B97F4A7C15ull) ^ (batch + 0xD1B54A32D192ED03ull)) ^
                     (path + 0x8CB92BA72F3D8DD7ull)) {}
  /// A stream of its own, from a number of another's.
  explicit RandomStream(uint64_t bits) {
    const uint64_t x = mixed(bits);
    a_ = mixed(x + 0x9E3779B97F4A7C15ull);
    b_ = mixed(x + 2 * 0x9E3779B97F4A7C15ull) | 1;  // never both zero
  }

  uint64_t bits() {
    const uint64_t sum = rotated(a_ + b_, 17) + a_, b = a_ ^ b_;
    a_ = rotated(a_, 49) ^ b ^ (b << 21);
    b_ = rotated(b, 28);
    return sum;
  }
  /// 0 <= u < 1.
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  /// -log(u) for a u that is as fine near 0 as floats are there: free flights reach 44 mean free paths.
  float exponential() {
    return -std::log(static_cast<float>(static_cast<int64_t>(bits() >> 1) | 1) * 0x1p-63f);
  }
  /// A point of the open unit disc except its centre, and its squared radius. Von Neumann's rejection.
  float disc(float& x, float& y) {
    while (true) {
      const uint64_t r = bits();
      x = static_cast<float>(static_cast<int32_t>(r >> 32)) * 0x1p-31f;
      y = static_cast<float>(static_cast<int32_t>(r)) * 0x1p-31f;
      const float square = x * x + y * y;
      if (square < 1 && square > 1e-12f) return square;
    }
  }

 private:
  uint64_t a_, b_;

  static uint64_t rotated(uint64_t x, int k) { return (x << k) | (x >> (64 - k)); }
  static uint64_t mixed(uint64_t x) {  // the finaliser of SplitMix64
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
    return x ^ (x >> 31);
  }
};

/// Two unit vectors that make a right-handed frame with unit `z`; Duff et al., "Building an orthonormal
/// basis, revisited" (2017).
template <typename Vector>
void frameAbout(const Vector& z, Vector& x, Vector& y) {
  using Real = typename Vector::value_type;
  const Real sign = std::copysign(Real(1), z[2]), a = -1 / (sign + z[2]), b = z[0] * z[1] * a;
  x = Vector(1 + sign * z[0] * z[0] * a, sign * b, -sign * z[0]);
  y = Vector(b, sign + z[1] * z[1] * a, -z[1]);
}

/// Evenly over the sphere; Marsaglia, "Choosing a point from the surface of a sphere" (1972).
inline Vec3f isotropicDirection(RandomStream& random) {
  float x, y;
  const float square = random.disc(x, y), root = 2 * std::sqrt(1 - square);
  return Vec3f(x * root, y * root, 1 - 2 * square);
}

/// Cosine of a deflection after Henyey and Greenstein (1941), u even in 0..1. Their inverse
/// (1 + g^2 - ((1 - g^2)/(1 + g s))^2)/(2 g), s = 2 u - 1, with the division by g carried out, so that it
/// holds for g = 0 as well.
inline double henyeyGreensteinCosine(double g, double u) {
  const double s = 2 * u - 1, q = 1 + g * s;
  const double c = (s + g * (0.5 * (s * s + 3) + g * (s + g * 0.5 * (s * s - 1)))) / (q * q);
  return c < -1 ? -1 : c > 1 ? 1 : c;
}

inline Vec3f deflected(const Vec3f& direction, double g, RandomStream& random) {
  const double cosine = henyeyGreensteinCosine(g, random.uniform());
  float x, y;
  const float square = random.disc(x, y);
  const float side = static_cast<float>(std::sqrt(1 - cosine * cosine)) / std::sqrt(square);
  Vec3f u, v;
  frameAbout(direction, u, v);
  const Vec3f turned = direction * static_cast<float>(cosine) + u * (x * side) + v * (y * side);
  return turned * (1.5f - 0.5f * turned.lengthSqr());  // one Newton step back to unit length
}

}  // namespace vdb_diffuse
