#include "shapes/lobes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "shapes/noise.h"

namespace vdb_diffuse {
namespace {

CloudPoint randomPoint(uint64_t n) {
  const auto at = [n](uint64_t a, double low, double high) {
    return static_cast<float>(low + (high - low) * uniformRandom(11, 3 * n + a));
  };
  return {at(0, -7, 7), at(1, -6, 6), at(2, -1, 6)};
}

TEST(Lobes, FewThatAreNearDecideTheDepthAsAllDo) {
  constexpr float kLeast = -0.6f, kMost = 1.1f;
  const std::vector<Lobe> lobes = cumulusLobes(3);
  std::vector<Lobe> near;
  size_t kept = 0, inside = 0;
  for (uint64_t i = 0; i < 3000; ++i) {
    const CloudPoint centre = randomPoint(i);
    const float radius = i % 2 == 0 ? 0.1f : 0.7f;
    lobesNear(lobes, centre, radius, kLeast, near);
    kept += near.size();
    for (uint64_t j = 0; j < 20; ++j) {
      CloudPoint p = randomPoint(100000 + 20 * i + j);  // brought into the ball
      const float length = std::hypot(p.x, p.y, p.z) / (0.99f * radius);
      p = {centre.x + p.x / length, centre.y + p.y / length, centre.z + p.z / length};
      const float all = depthInLobes(lobes, p, kLeast, kMost);
      EXPECT_EQ(depthInLobes(near, p, kLeast, kMost), all);
      inside += all > 0;
    }
  }
  EXPECT_GT(inside, 2000u);                           // the law was put to the test
  EXPECT_LT(kept, lobes.size() * size_t(3000) / 20);  // and the lists are worth it
}

TEST(Lobes, DepthHasNoStepWhereLobesMeet) {
  const std::vector<Lobe> lobes = cumulusLobes(1);
  for (uint64_t i = 0; i < 20000; ++i) {
    CloudPoint p = randomPoint(i);
    const float here = depthInLobes(lobes, p, -0.6f, 1.1f);
    p.x += 1e-3f;
    const float there = depthInLobes(lobes, p, -0.6f, 1.1f);
    if (std::min(here, there) > -0.6f) {
      EXPECT_LT(std::abs(here - there), 2e-3f);
    }
  }
}

}  // namespace
}  // namespace vdb_diffuse
