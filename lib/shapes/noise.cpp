#include "shapes/noise.h"

#include <cmath>

namespace vdb_diffuse {
namespace {

uint32_t finished(uint32_t h) {
  h = (h ^ (h >> 15)) * 0x2C1B3C6Du;
  h = (h ^ (h >> 12)) * 0x297A2D39u;
  return h ^ (h >> 15);
}

// Directions to the middles of a cube's edges, four of them twice to make 16.
constexpr float kGradient[16][3] = {{1, 1, 0},  {-1, 1, 0},  {1, -1, 0}, {-1, -1, 0}, {1, 0, 1},  {-1, 0, 1},
                                    {1, 0, -1}, {-1, 0, -1}, {0, 1, 1},  {0, -1, 1},  {0, 1, -1}, {0, -1, -1},
                                    {1, 1, 0},  {-1, 1, 0},  {0, -1, 1}, {0, -1, -1}};

float fade(float t) {
  return t * t * t * (t * (t * 6 - 15) + 10);
}
float lerp(float a, float b, float t) {
  return a + t * (b - a);
}

/// Channel c takes its gradients from four bits of the corners' hashes that no other channel uses.
template <int Channels>
void noise(uint32_t seed, float x, float y, float z, float (&value)[Channels]) {
  const float fx = std::floor(x), fy = std::floor(y), fz = std::floor(z);
  x -= fx, y -= fy, z -= fz;
  constexpr uint32_t kx = 0x8DA6B343u, ky = 0xD8163841u, kz = 0xCB1AB31Fu;
  const uint32_t x0 = static_cast<uint32_t>(static_cast<int32_t>(fx)) * kx;
  const uint32_t y0 = static_cast<uint32_t>(static_cast<int32_t>(fy)) * ky;
  const uint32_t z0 = static_cast<uint32_t>(static_cast<int32_t>(fz)) * kz + seed * 0x9E3779B1u;
  const float u = fade(x), v = fade(y), w = fade(z);
  uint32_t hash[8];
  for (uint32_t i = 0; i < 8; ++i)
    hash[i] = finished((x0 + (i & 1) * kx) ^ (y0 + (i >> 1 & 1) * ky) ^ (z0 + (i >> 2) * kz));
  for (int c = 0; c < Channels; ++c) {
    float n[8];
    for (int i = 0; i < 8; ++i) {
      const float* g = kGradient[hash[i] >> (28 - 4 * c) & 15];
      n[i] = g[0] * (x - float(i & 1)) + g[1] * (y - float(i >> 1 & 1)) + g[2] * (z - float(i >> 2));
    }
    value[c] = lerp(lerp(lerp(n[0], n[1], u), lerp(n[2], n[3], u), v),
                    lerp(lerp(n[4], n[5], u), lerp(n[6], n[7], u), v), w);
  }
}

}  // namespace

float gradientNoise(uint32_t seed, float x, float y, float z) {
  float value[1];
  noise(seed, x, y, z, value);
  return value[0];
}

Noise3 gradientNoise3(uint32_t seed, float x, float y, float z) {
  float value[3];
  noise(seed, x, y, z, value);
  return {value[0], value[1], value[2]};
}

}  // namespace vdb_diffuse
