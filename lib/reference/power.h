#pragma once

#include <algorithm>
#include <cmath>

#include "reference/luminance.h"

namespace vdb_diffuse {

/// (1 - exp(-x)) / x, x >= 0: the mean transmittance within an optical depth x.
inline float meanTransmittance(float x) {
  if (x < 0.1f) return 1 - x * (0.5f - x * (1 / 6.f - x * (1 / 24.f - x / 120.f)));
  return (1 - std::exp(-x)) / x;
}

/// What a path carries, one number for each channel.
template <int C>
struct Power {
  float c[C];

  float largest() const { return C == 1 ? c[0] : std::max({c[0], c[C / 2], c[C - 1]}); }
  double bright() const {
    if (C == 1) return c[0];
    return luminance(Vec3d(c[0], c[C / 2], c[C - 1]));
  }
  void scale(float f) {
    for (float& x : c) x *= f;
  }
};

}  // namespace vdb_diffuse
