#pragma once

#include <cstdint>

namespace vdb_diffuse {

/// Random numbers and gradient noise that are functions of a seed and a position: no state, so that any
/// thread may ask for any of them in any order. Mixing after Steele, Lea and Flood (2014), "SplitMix64".
inline uint64_t mixed(uint64_t x) {
  x += 0x9E3779B97F4A7C15ull;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}

/// The n-th random number of a seed, uniform in [0, 1).
inline double uniformRandom(uint64_t seed, uint64_t n) {
  return static_cast<double>(mixed(mixed(seed) ^ (n * 0xD1B54A32D192ED03ull)) >> 11) * 0x1p-53;
}

/// Smooth noise with features of size 1, after Perlin (2002), "Improving noise": zero on the lattice of
/// integers, twice differentiable, mean 0, within (-1, 1). Coordinates must stay within +-2^30.
float gradientNoise(uint32_t seed, float x, float y, float z);

/// Three independent noises at one place, for little more than the cost of one.
struct Noise3 {
  float x, y, z;
};
Noise3 gradientNoise3(uint32_t seed, float x, float y, float z);

}  // namespace vdb_diffuse
