#include <tbb/global_control.h>

#include "grid/error.h"
#include "reference/random.h"
#include "reference/runs.h"
#include "reference/spread_points.h"

namespace vdb_diffuse {
namespace {

Medium lumpy(double albedo = 1, double g = 0) {
  Medium medium =
      boxMedium(Coord(12, 10, 9), Transform::uniform(0.3), [](Coord p) { return lumpyDensity(p); });
  setOptics(medium, 2, albedo, g);
  return medium;
}

Scene sunAndSky() {
  Scene scene = sunScene(Vec3d(1, -2, -3));
  scene.lights.push_back({"sky", DomeLight{Vec3d(0.1), nullptr, 0}});
  return scene;
}

void expectSameBits(const Medium& medium, const Channels& a, const Channels& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t c = 0; c < a.size(); ++c)
    forEachVoxel(medium.topology(), [&](Coord p, size_t i) { ASSERT_EQ(a[c][i], b[c][i]) << p; });
}

TEST(ReferenceStatistics, SameBitsForAnyNumberOfThreadsAndGrids) {
  const Medium medium = lumpy(0.9, 0.5);
  ReferenceSettings settings = paths(30000);
  settings.noise = 0.05;  // and it stops where it did
  settings.want_flux = true;
  const ReferenceResult all = reference(medium, sunAndSky(), settings);
  for (int threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    settings.max_bytes = threads == 2 ? 3'000'000 : 0;
    const ReferenceResult few = reference(medium, sunAndSky(), settings);
    EXPECT_EQ(few.samples, all.samples);
    EXPECT_EQ(few.noise, all.noise);
    expectSameBits(medium, few.diffuse, all.diffuse);
    expectSameBits(medium, few.direct, all.direct);
    expectSameBits(medium, few.diffuse_se, all.diffuse_se);
    for (int a = 0; a < 3; ++a)
      forEachVoxel(medium.topology(), [&](Coord, size_t i) { ASSERT_EQ(few.flux[a][i], all.flux[a][i]); });
    EXPECT_EQ(few.energy.absorbed, all.energy.absorbed);
  }
  settings.seed = 2;
  EXPECT_NE(reference(medium, sunAndSky(), settings).energy.absorbed, all.energy.absorbed);
}

// Independent runs spread as their standard errors say.
TEST(ReferenceStatistics, StandardErrorIsHonest) {
  const Medium medium = lumpy(0.9, 0.3);
  constexpr int kRuns = 24;
  std::vector<double> sum(medium.density.values.size()), square(sum), claimed(sum);
  for (uint64_t seed = 1; seed <= kRuns; ++seed) {
    const ReferenceResult result = reference(medium, sunAndSky(), paths(12800, seed));
    forEachVoxel(medium.topology(), [&](Coord, size_t i) {
      const double v = result.diffuse[0][i], se = result.diffuse_se[0][i];
      sum[i] += v, square[i] += v * v, claimed[i] += se * se / kRuns;
    });
  }
  double ratio = 0;
  forEachVoxel(medium.topology(), [&](Coord, size_t i) {
    ratio += (square[i] - sum[i] * sum[i] / kRuns) / (kRuns - 1) / claimed[i];
  });
  ratio /= static_cast<double>(medium.topology().activeVoxelCount());
  EXPECT_NEAR(ratio, 1, 0.1);  // neighbours are correlated: some tens of independent voxels, 23 degrees each
}

// A path crosses many voxels, so that their errors go together: how much, is measured, and independent runs
// confirm it for the means of 4^3 voxels.
TEST(ReferenceStatistics, CorrelationOfNeighboursIsMeasured) {
  Medium medium = boxMedium(Coord(16), Transform::uniform(0.3), [](Coord p) { return lumpyDensity(p); });
  setOptics(medium, 2, 1);
  constexpr int kRuns = 24;
  std::vector<double> sum(64), square(64), independent(64);
  std::vector<int> count(64);
  double claimed = 0;
  for (uint64_t seed = 1; seed <= kRuns; ++seed) {
    const ReferenceResult result = reference(medium, sunAndSky(), paths(6400, seed));
    claimed += result.correlation[1] / kRuns;
    EXPECT_GT(result.correlation[2], result.correlation[1]);
    EXPECT_GT(result.correlation[1], result.correlation[0]);
    EXPECT_GT(result.correlation[0], 1);
    std::vector<double> cell(64);
    forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
      const int n = (p[0] / 4) * 16 + (p[1] / 4) * 4 + p[2] / 4;
      cell[n] += result.diffuse[0][i];
      count[n] += seed == 1;
      independent[n] += std::pow(static_cast<double>(result.diffuse_se[0][i]), 2) / kRuns;
    });
    for (int n = 0; n < 64; ++n) sum[n] += cell[n], square[n] += cell[n] * cell[n];
  }
  double together = 0, alone = 0;
  for (int n = 0; n < 64; ++n) {
    together += (square[n] - sum[n] * sum[n] / kRuns) / (kRuns - 1) / count[n];
    alone += independent[n] / count[n];
  }
  EXPECT_NEAR(claimed / std::sqrt(together / alone), 1, 0.1);
}

TEST(ReferenceStatistics, StopsAtTheNoiseAskedFor) {
  const Medium medium = lumpy();
  ReferenceSettings settings;
  for (double noise : {0.2, 0.05}) {
    settings.noise = noise;
    const ReferenceResult result = reference(medium, sunAndSky(), settings);
    EXPECT_LE(result.noise, noise);
    double variance = 0, mean = 0;
    forEachVoxel(medium.topology(), [&](Coord, size_t i) {
      variance += std::pow(static_cast<double>(result.diffuse_se[0][i]), 2);
      mean += std::pow(static_cast<double>(result.diffuse[0][i]), 2);
    });
    EXPECT_NEAR(result.noise, std::sqrt(variance / mean), 1e-5);
  }
  settings = {};
  settings.seconds = 0.2;
  EXPECT_NEAR(reference(medium, sunAndSky(), settings).seconds, 0.2, 0.2);
  EXPECT_EQ(reference(medium, sunAndSky(), paths(10)).samples, 10u);
  EXPECT_EQ(reference(medium, sunAndSky(), paths(54321)).samples, 54321u);
}

TEST(ReferenceStatistics, CancelsAndRefuses) {
  const Medium medium = lumpy();
  ReferenceSettings settings;
  settings.noise = 1e-6;
  int calls = 0;
  settings.progress = [&](std::string_view, double fraction) {
    EXPECT_GE(fraction, 0);
    EXPECT_LE(fraction, 1);
    if (++calls > 50) throw Interrupted();
  };
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_THROW(reference(medium, sunAndSky(), settings), Interrupted);
  settings.progress = nullptr;
  settings.max_bytes = 1000;
  EXPECT_THROW(reference(medium, sunAndSky(), settings), InputError);
}

// A run in colour is three in grey.
TEST(ReferenceStatistics, ColourIsThreeGreys) {
  Medium medium = lumpy(1, 0.4);
  const Topology& topology = medium.topology();
  const Vec3d sigma_s(2, 1, 4), sigma_a(0.1, 0, 0.5), light(1, 2, 0.5), sun(1, -2, -3);
  medium.optics.sigma_s = sigma_s;
  medium.optics.sigma_a = sigma_a;
  setEmission(medium, [](Coord p) { return 0.1 * p[0]; });
  constexpr int kRuns = 8;
  Repeated colour[2][3];
  for (uint64_t seed = 1; seed <= kRuns; ++seed) {
    const ReferenceResult result = reference(medium, sunScene(sun, light), paths(1e4, seed));
    ASSERT_EQ(result.diffuse.size(), 3u);
    for (int c = 0; c < 3; ++c) {
      colour[0][c].values.push_back(meanOf(topology, result.diffuse[c]));
      colour[1][c].values.push_back(meanOf(topology, result.direct[c]));
    }
  }
  for (int c = 0; c < 3; ++c) {
    medium.optics.sigma_s = Vec3d(sigma_s[c]);
    medium.optics.sigma_a = Vec3d(sigma_a[c]);
    Repeated grey[2];
    for (uint64_t seed = 1; seed <= kRuns; ++seed) {
      const ReferenceResult result = reference(medium, sunScene(sun, Vec3d(light[c])), paths(1e4, seed));
      ASSERT_EQ(result.diffuse.size(), 1u);
      grey[0].values.push_back(meanOf(topology, result.diffuse[0]));
      grey[1].values.push_back(meanOf(topology, result.direct[0]));
    }
    for (int k = 0; k < 2; ++k) {
      const double error = std::hypot(colour[k][c].error(), grey[k].error());
      EXPECT_NEAR(colour[k][c].mean(), grey[k].mean(), 5 * error) << c;
      EXPECT_LT(error, 0.02 * grey[k].mean()) << c;  // blue, a fifth of the light, is drawn least
    }
  }
}

TEST(ReferenceStatistics, HenyeyGreensteinHasItsMoments) {
  for (double g : {0.0, 1e-9, 0.3, -0.7, 0.95, 0.999, -0.999}) {
    double first = 0, second = 0;  // of the cosine; Legendre moments are g and g^2
    constexpr int kN = 200000;
    for (int n = 0; n < kN; ++n) {
      const double c = henyeyGreensteinCosine(g, (n + 0.5) / kN);
      first += c / kN;
      second += (1.5 * c * c - 0.5) / kN;
    }
    EXPECT_NEAR(first, g, 1e-4) << g;
    EXPECT_NEAR(second, g * g, 1e-4) << g;
    RandomStream random(1, 2, 3);
    const Vec3f before = Vec3f(0.1f, -0.8f, -0.3f).unit();
    double mean = 0;
    for (int n = 0; n < 20000; ++n) {
      const Vec3f after = deflected(before, g, random);
      ASSERT_NEAR(after.length(), 1, 1e-5);
      mean += before.dot(after) / 20000;
    }
    EXPECT_NEAR(mean, g, 0.02) << g;
  }
}

TEST(ReferenceStatistics, SpreadPointsAreEven) {
  for (int dimensions : {2, 4}) {
    constexpr int kN = 1000;
    double mean[4] = {}, product = 0;
    for (uint64_t i = 0; i < kN; ++i) {
      RandomStream random(1, 2, i);
      double u[4];
      SpreadPoints(dimensions, kN).point(i, random, u);
      for (int a = 0; a < 4; ++a) {
        ASSERT_GE(u[a], 0);
        ASSERT_LT(u[a], 1);
        mean[a] += u[a] / kN;
      }
      product += u[0] * u[1] / kN;
    }
    // By chance alone 0.29 / sqrt(1000) = 0.009; spread, a part of that.
    for (int a = 0; a < dimensions; ++a) EXPECT_NEAR(mean[a], 0.5, 0.006) << dimensions;
    EXPECT_NEAR(product, 0.25, 0.006);
  }
}

}  // namespace
}  // namespace vdb_diffuse
