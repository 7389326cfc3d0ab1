#include "shapes/noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace vdb_diffuse {
namespace {

TEST(Noise, IsZeroOnTheLatticeAndSmoothAcrossIt) {
  for (int i = -20; i < 20; ++i) {
    EXPECT_EQ(gradientNoise(7, float(i), float(3 * i), float(-i)), 0);
    const float step = 1e-3f, here = float(i);  // slopes on the two sides of a lattice plane agree
    const auto slope = [&](float from) {
      return (gradientNoise(7, from + step, 0.3f, 0.7f) - gradientNoise(7, from, 0.3f, 0.7f)) / step;
    };
    EXPECT_NEAR(slope(here - step), slope(here), 0.02);
  }
}

TEST(Noise, HasMeanZeroAndStaysWithinOne) {
  double sum = 0, squares = 0, together = 0, largest = 0;
  constexpr int kPoints = 200000;
  for (uint64_t i = 0; i < kPoints; ++i) {
    const auto at = [&](uint64_t a) { return static_cast<float>(2000 * uniformRandom(5, 3 * i + a) - 1000); };
    const Noise3 n = gradientNoise3(1, at(0), at(1), at(2));
    sum += n.x;
    squares += n.x * n.x;
    together += n.x * n.y;
    for (float v : {n.x, n.y, n.z}) largest = std::max(largest, double(std::abs(v)));
  }
  const double deviation = std::sqrt(squares / kPoints);
  EXPECT_GT(deviation, 0.2);
  EXPECT_LT(std::abs(sum / kPoints), 5 * deviation / std::sqrt(double(kPoints)));
  EXPECT_LT(std::abs(together / squares),
            5 / std::sqrt(double(kPoints)));  // channels know nothing of each other
  EXPECT_LT(largest, 1);
  EXPECT_GT(largest, 0.7);
}

TEST(Noise, SeedsGiveDifferentNoise) {
  double together = 0, squares = 0;
  for (int i = 0; i < 20000; ++i) {
    const float x = 0.37f * float(i), a = gradientNoise(1, x, 0.4f, 0.6f),
                b = gradientNoise(2, x, 0.4f, 0.6f);
    together += a * b;
    squares += a * a;
  }
  EXPECT_LT(std::abs(together / squares), 0.05);
}

}  // namespace
}  // namespace vdb_diffuse
