#include "shapes/lobes.h"

#include <algorithm>
#include <cmath>

#include "grid/volume.h"
#include "shapes/noise.h"

namespace vdb_diffuse {
namespace {

constexpr int kSizes = 3;         // lobes, lobes on lobes, lobes on those
constexpr float kCrease = 0.08f;  // two lobes melt into one where their depths differ by less
constexpr double kPi = 3.14159265358979323846;

/// Draws numbers in a fixed order while the heap is built, which one thread does.
struct Draw {
  uint64_t seed, n = 0;
  double operator()(double low, double high) { return low + (high - low) * uniformRandom(seed, n++); }
};

float squaredDistance(CloudPoint a, CloudPoint b) {
  return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y) + (a.z - b.z) * (a.z - b.z);
}

/// Depth in the lobe that is deepest here: the plain union, which changes no faster than distance.
float deepest(const std::vector<Lobe>& lobes, CloudPoint p, float least) {
  float depth = least;
  for (const Lobe& lobe : lobes) {
    const float squared = squaredDistance(lobe.centre, p), farthest = std::max(lobe.radius - depth, 0.0f);
    if (squared < farthest * farthest) depth = lobe.radius - std::sqrt(squared);
  }
  return depth;
}

/// Appends a lobe and, on its surface, smaller ones.
void grow(std::vector<Lobe>& lobes, const Vec3d& centre, double radius, int size, Draw& draw) {
  const size_t self = lobes.size();
  const CloudPoint at{float(centre[0]), float(centre[1]), float(centre[2])};
  lobes.push_back({at, float(radius), float(radius), 0});
  if (size + 1 < kSizes) {
    const int count = size == 0 ? 16 : 9;
    for (int i = 0; i < count; ++i) {
      // Fewer below: the underside of a cumulus is smooth.
      const double up = draw(-0.35, 1), angle = draw(0, 2 * kPi), flat = std::sqrt(1 - up * up);
      const double child = radius * draw(0.28, 0.52);
      const Vec3d direction(flat * std::cos(angle), flat * std::sin(angle), up);
      grow(lobes, centre + direction * (radius * draw(0.8, 0.98)), child, size + 1, draw);
    }
  }
  for (size_t i = self + 1; i < lobes.size(); ++i) {
    lobes[self].reach =
        std::max(lobes[self].reach, std::sqrt(squaredDistance(at, lobes[i].centre)) + lobes[i].radius);
  }
  lobes[self].end = static_cast<uint32_t>(lobes.size());
}

}  // namespace

std::vector<Lobe> cumulusLobes(uint64_t seed) {
  std::vector<Lobe> lobes;
  Draw draw{seed};
  // The towers stand on an ellipse, spread like the seeds of a sunflower so that none is left alone; the
  // tallest are near one point off the middle.
  constexpr int kTowers = 9;
  const double turn = draw(0, 2 * kPi), summit_x = draw(-1.2, 1.2), summit_y = draw(-0.7, 0.7);
  for (int i = 0; i < kTowers; ++i) {
    const double r = std::sqrt((i + draw(0.2, 0.8)) / kTowers), angle = turn + 2.39996 * i + draw(-0.3, 0.3);
    const double x = 3.3 * r * std::cos(angle), y = 2.3 * r * std::sin(angle);
    const double rise = std::exp(-0.35 * (std::pow(x - summit_x, 2) + std::pow(y - summit_y, 2)));
    const double radius = (0.75 + 0.75 * rise) * draw(0.85, 1.15);
    grow(lobes, Vec3d(x, y, 0.55 * radius + draw(0, 0.3)), radius, 0, draw);
    if (rise > 0.35) {  // a tower: a second lobe on the first
      const double dx = draw(-0.4, 0.4), dy = draw(-0.4, 0.4), up = radius * 1.2 + rise * draw(0.4, 1.4);
      grow(lobes, Vec3d(x + dx, y + dy, up), radius * draw(0.65, 0.9), 0, draw);
    }
  }
  constexpr int kDetached = 5;
  for (int i = 0; i < kDetached; ++i) {
    const double angle = turn + (i + draw(0.2, 0.8)) * 2 * kPi / kDetached, radius = draw(0.18, 0.4);
    const double reach = draw(1.0, 1.12);
    grow(lobes, Vec3d(5.2 * reach * std::cos(angle), 4.2 * reach * std::sin(angle), draw(0.4, 2.2)), radius,
         1, draw);
  }
  return lobes;
}

// With m the depth in the deepest lobe, m + K/2 log(sum_i (1 - (m - depth_i)/K)^2) over the lobes within K of
// it: smooth where two lobes are equally deep, the same in any order, and free of those that are K shallower.
float depthInLobes(const std::vector<Lobe>& lobes, CloudPoint p, float least, float most) {
  const float depth = deepest(lobes, p, least);
  if (depth <= least || depth >= most) return std::min(depth, most);
  float sum = 0;
  for (const Lobe& lobe : lobes) {
    const float squared = squaredDistance(lobe.centre, p);
    const float farthest = std::max(lobe.radius + kCrease - depth, 0.0f);
    if (squared >= farthest * farthest) continue;
    const float share = 1 - (depth - lobe.radius + std::sqrt(squared)) / kCrease;
    sum += share * share;
  }
  return std::min(depth + 0.5f * kCrease * std::log(sum), most);
}

void lobesNear(const std::vector<Lobe>& lobes, CloudPoint centre, float radius, float least,
               std::vector<Lobe>& near) {
  near.clear();
  float deepest_reached = least, shallowest = least;  // of the deepest lobe, over the ball
  const auto depthAtBest = [&](const Lobe& lobe, float size) {
    return size - std::sqrt(squaredDistance(lobe.centre, centre)) + radius;
  };
  for (size_t i = 0; i < lobes.size();) {
    const Lobe& lobe = lobes[i];
    const float own = depthAtBest(lobe, lobe.radius);
    if (own > least - kCrease) near.push_back(lobe);
    deepest_reached = std::max(deepest_reached, own);
    shallowest = std::max(shallowest, own - 2 * radius);
    i = depthAtBest(lobe, lobe.reach) > least - kCrease ? i + 1 : lobe.end;
  }
  if (deepest_reached <= least) near.clear();
  const auto drowned = [&](const Lobe& lobe) {
    return depthAtBest(lobe, lobe.radius) < shallowest - kCrease;
  };
  near.erase(std::remove_if(near.begin(), near.end(), drowned), near.end());
}

}  // namespace vdb_diffuse
