#include "shapes/cloud.h"

#include <algorithm>
#include <cmath>

#include "shapes/lobes.h"
#include "shapes/noise.h"
#include "shapes/sparse_fill.h"

namespace vdb_diffuse {
namespace {

constexpr float kBend = 0.48f;       // how far noise bends the lobes out of round, along each axis
constexpr float kBendSize = 1.7f;    // its wavelength
constexpr float kBaseBend = 0.35f;   // how much of that the base takes part in
constexpr float kBillow = 0.26f;     // height of the largest noise billows
constexpr float kBillowSize = 0.9f;  // their wavelength; each octave is half as long
constexpr float kRoughness = 0.62f;  // and this much as high as the one before
constexpr int kOctaves = 10;
constexpr float kEdge = 0.17f;         // depth over which the density rises from zero to the peak, typically
constexpr float kSoftest = 0.75f;      // and at most
constexpr float kWisps = 0.5f;         // how far outside the lobes wisps may lie
constexpr float kWispDensity = 0.06f;  // their highest density, of the peak
constexpr float kCutoff = 1e-4f;       // of the peak: thinner than this is empty
constexpr float kBendStretch =
    2.0f;  // bending takes two points apart by at most so many times their distance
// Nothing is active farther out than this, and all is at the peak farther in: the octaves' sum, and the edge.
constexpr float kOutside = -0.6f, kInside = 1.1f;

float smoothStep(float t) {
  t = std::clamp(t, 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

float softMin(float a, float b, float width) {
  const float overlap = std::max(width - std::abs(a - b), 0.0f);
  return std::min(a, b) - overlap * overlap / (4 * width);
}

/// The density of a cloud at a point, over its peak. Noise finer than the voxels is left out.
class CloudDensity {
 public:
  CloudDensity(uint64_t seed, float voxel_size) : seed_(static_cast<uint32_t>(mixed(seed))) {
    for (int i = 0; i < kOctaves; ++i) {
      const float voxels = std::ldexp(kBillowSize, -i) / voxel_size;
      weight_[i] = smoothStep((voxels - 2) / 2);  // from nothing at 2 voxels a wave to all at 4
    }
  }

  /// Where in the heap of lobes this point lies.
  CloudPoint bent(CloudPoint p) const {
    const Noise3 n = gradientNoise3(layer(0), p.x / kBendSize, p.y / kBendSize, p.z / kBendSize);
    return {p.x + kBend * n.x, p.y + kBend * n.y, p.z + kBend * n.z};
  }

  float operator()(const std::vector<Lobe>& lobes, CloudPoint p) const {
    const CloudPoint q = bent(p);
    const float base = p.z + kBaseBend * (q.z - p.z);
    const float outline = softMin(depthInLobes(lobes, q, kOutside, kInside), base, 0.2f);
    if (outline <= kOutside) return 0;
    const Noise3 soft = gradientNoise3(layer(1), 0.7f * p.x, 0.7f * p.y, 0.7f * p.z);
    const float peak = std::min(0.85f + 0.5f * soft.x, 1.0f);
    if (outline >= kInside) return peak;

    float billows = 0, wisps = 0, height = kBillow, amplitude = 1, scale = 1 / kBillowSize;
    for (uint32_t i = 0; i < kOctaves && weight_[i] > 0; ++i) {
      const float n = gradientNoise(layer(2 + i), scale * q.x, scale * q.y, scale * q.z);
      billows += weight_[i] * height * (std::abs(2 * n) - 0.45f);  // round on the outside, creased inward
      wisps += weight_[i] * amplitude * n;
      height *= kRoughness, amplitude *= 0.5f, scale *= 2;
    }
    const float edge = std::min(kEdge * std::exp2(3.5f * soft.y), kSoftest), depth = outline + billows;
    const float body = peak * smoothStep(depth / edge);
    const float fringe = kWispDensity * smoothStep((outline + kWisps) / kWisps);
    const float density = std::max(body, fringe * smoothStep(3 * (wisps - 0.25f)));
    return density < kCutoff ? 0 : density;
  }

 private:
  uint32_t layer(uint32_t n) const { return seed_ + 0x9E3779B9u * n; }

  uint32_t seed_;
  float weight_[kOctaves];
};

WorldBox boxOf(const std::vector<Lobe>& lobes) {
  WorldBox box{Vec3d(0), Vec3d(0)};
  for (const Lobe& lobe : lobes) {
    const Vec3d centre(lobe.centre.x, lobe.centre.y, lobe.centre.z), reach(lobe.radius - kOutside + kBend);
    box.low = openvdb::math::minComponent(box.low, centre - reach);
    box.high = openvdb::math::maxComponent(box.high, centre + reach);
  }
  box.low[2] = kOutside - kBaseBend * kBend;  // the base cuts it
  return box;
}

/// The lobes that matter within a ball: a list per thread, so that it is not allocated for each.
const std::vector<Lobe>& nearLobes(const std::vector<Lobe>& lobes, const CloudDensity& density, CloudPoint p,
                                   float radius) {
  thread_local std::vector<Lobe> list;
  const float bent_radius = std::min(kBendStretch * radius, radius + 2 * std::sqrt(3.0f) * kBend);
  lobesNear(lobes, density.bent(p), bent_radius, kOutside, list);
  return list;
}

double volumeOf(const std::vector<Lobe>& lobes, const WorldBox& box, uint64_t seed, double voxel_size) {
  const CloudDensity density(seed, static_cast<float>(voxel_size));
  return estimateVolume(box, [&](const Vec3d& p_world) {
    const CloudPoint p{float(p_world[0]), float(p_world[1]), float(p_world[2])};
    const std::vector<Lobe>& near = nearLobes(lobes, density, p, 0);
    return !near.empty() && density(near, p) > 0;
  });
}

Volume filledCloud(const std::vector<Lobe>& lobes, const WorldBox& box, uint64_t seed, double peak,
                   double voxel_size) {
  const float h = static_cast<float>(voxel_size);
  const CloudDensity density(seed, h);
  const auto near = [&, h](const Coord& low, const Coord& high) -> const std::vector<Lobe>& {
    const Coord twice = low + high;
    const CloudPoint centre{0.5f * h * float(twice[0]), 0.5f * h * float(twice[1]),
                            0.5f * h * float(twice[2])};
    return nearLobes(lobes, density, centre, std::sqrt(3.0f) * 0.5f * h * float(high[0] - low[0]));
  };
  Formula formula;
  for (int a = 0; a < 3; ++a) {
    formula.lowest[a] = static_cast<int>(std::floor(box.low[a] / h));
    formula.highest[a] = static_cast<int>(std::ceil(box.high[a] / h));
  }
  formula.may_touch = [&](const Coord& low, const Coord& high) {
    return float(high[2]) * h > box.low[2] && !near(low, high).empty();
  };
  formula.fill = [&](const Coord& origin, float* values, BlockMask& active) {
    const std::vector<Lobe>& lobes_here = near(origin, origin.offsetBy(kBlockWidth - 1));
    for (int n = 0; n < kBlockVoxels; ++n) {
      const Coord p = origin + voxelLocal(n);
      const float value = density(lobes_here, {h * float(p[0]), h * float(p[1]), h * float(p[2])});
      if (value <= 0) continue;
      values[n] = static_cast<float>(peak) * value;
      active.setOn(n);
    }
  };
  return sparseFill(formula, voxel_size);
}

}  // namespace

Volume makeCloud(const CloudSettings& settings) {
  constexpr double kLeafFill = 0.3;  // on the low side of what is met
  requireFeasible(settings.size, kLeafFill);
  const std::vector<Lobe> lobes = cumulusLobes(settings.seed);
  const WorldBox box = boxOf(lobes);
  return fillToSize(
      settings.size, [&](double h) { return volumeOf(lobes, box, settings.seed, h); },
      [&](double h) { return filledCloud(lobes, box, settings.seed, settings.peak, h); });
}

}  // namespace vdb_diffuse
