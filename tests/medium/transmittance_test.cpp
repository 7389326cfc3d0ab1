#include <gtest/gtest.h>

#include "medium/transmittance.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

TEST(ColumnDensity, IsLengthTimesDensityInAUniformBox) {
  const Medium medium = boxMedium(
      Coord(20, 30, 10), Transform(), [](Coord) { return 2.0; }, Coord(-7, 3, 100));
  const Vec3d low = Vec3d(-7.5, 2.5, 99.5), high = low + Vec3d(20, 30, 10);
  for (int n = 0; n < 2000; ++n) {
    const auto random = [n](int i) { return hashed(Coord(n, i, 0)); };
    const Vec3d p(30 * random(0) - 12, 40 * random(1) - 2, 20 * random(2) + 95);
    const Vec3d d(random(3) - 0.5, random(4) - 0.5, n % 5 ? random(5) - 0.5 : 0.0);
    const double t0 = random(6), t1 = t0 + 60 * random(7);
    double enter = t0, leave = t1;
    for (int a = 0; a < 3; ++a) {
      if (d[a] == 0) {
        if (p[a] < low[a] || p[a] > high[a]) leave = enter;
        continue;
      }
      const double u = (low[a] - p[a]) / d[a], v = (high[a] - p[a]) / d[a];
      enter = std::max(enter, std::min(u, v));
      leave = std::min(leave, std::max(u, v));
    }
    EXPECT_NEAR(columnDensity(medium.density, p, d, t0, t1), 2 * std::max(0.0, leave - enter), 1e-9) << n;
  }
}

TEST(ColumnDensity, AddsUpVoxelByVoxel) {
  // Three pieces with empty blocks between them.
  const auto rho = [](Coord p) {
    return (p[0] >= 9 && p[0] < 41) || (p[1] >= 9 && p[1] < 30) ? -1 : lumpyDensity(p);
  };
  const Medium medium = boxMedium(Coord(50, 40, 22), Transform(), rho, Coord(-25, -20, -11));
  const Topology& topology = medium.topology();
  for (int n = 0; n < 200; ++n) {
    const auto random = [n](int i) { return hashed(Coord(n, i, 1)); };
    const Vec3d p(50 * random(0) - 25, 40 * random(1) - 20, 22 * random(2) - 11);
    const Vec3d d(2 * random(3) - 1, 2 * random(4) - 1, random(5) - 0.5);
    constexpr int kSteps = 40000;  // small steps along the ray, each in the voxel where its middle lies
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
      const Vec3d q = p + d * (80.0 * (i + 0.5) / kSteps);
      const Coord voxel(static_cast<int>(std::floor(q[0] + 0.5)), static_cast<int>(std::floor(q[1] + 0.5)),
                        static_cast<int>(std::floor(q[2] + 0.5)));
      sum += medium.density.values.at(topology, voxel) * 80.0 / kSteps;
    }
    const double column = columnDensity(medium.density, p, d, 0, 80);
    EXPECT_NEAR(column, sum, 0.02) << n;  // some 60 crossings, each within a step
    // The ray may be cut anywhere, and walked from either end.
    EXPECT_NEAR(columnDensity(medium.density, p, d, 0, 33) + columnDensity(medium.density, p, d, 33, 80),
                column, 1e-9);
    EXPECT_NEAR(columnDensity(medium.density, p + d * 80.0, -d, 0, 80), column, 1e-9);
    // It may stop early, but not before it has enough.
    const double enough = columnDensity(medium.density, p, d, 0, 80, 0.5 * column);
    EXPECT_GE(enough, std::min(column, 0.5 * column));
    EXPECT_LE(enough, column);
  }
}

TEST(BeamAverage, IsTheMeanOfTheExponential) {
  for (double before : {0.0, 1.0, 20.0})
    for (double inside : {0.0, 1e-12, 1e-9, 1e-7, 1e-3, 1.0, 30.0}) {
      double mean = 0;
      constexpr int kSteps = 20000;
      for (int i = 0; i < kSteps; ++i) mean += std::exp(-before - inside * (i + 0.5) / kSteps) / kSteps;
      EXPECT_NEAR(beamAverage(before, inside), mean, 1e-6 * mean) << before << ' ' << inside;
    }
}

}  // namespace
}  // namespace vdb_diffuse
