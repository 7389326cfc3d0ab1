#include "reference/runs.h"

namespace vdb_diffuse {
namespace {

constexpr double kL = 3;

Medium lump(double sigma, const Vec3d& colour, double g) {
  Medium medium =
      boxMedium(Coord(10, 8, 12), Transform(Vec3d(0.5, 0, 0), Vec3d(0, -0.7, 0), Vec3d(0, 0, 0.4), Vec3d(9)),
                [](Coord p) { return lumpyDensity(p); });
  medium.optics.sigma_s = colour * sigma;
  medium.optics.g = g;
  return medium;
}

// In a uniform sky of radiance L a medium that glows with L has L everywhere, whatever part of it scatters.
TEST(ReferenceAlbedo, FillsTheFurnaceEvenly) {
  for (const double sigma : {0.5, 5.0})
    for (const int kind : {0, 1, 2}) {  // grey; a coloured albedo; coloured extinction too
      Medium medium = lump(sigma, kind == 2 ? Vec3d(1, 0.5, 3) : Vec3d(1), 0.3);
      setEmission(medium, [](Coord) { return kL; });
      setAlbedo(
          medium, [](Coord p, int c) { return hashed(p, 9) < 0.2 ? 0 : hashed(p, 3 + c); }, kind ? 3 : 1);
      Scene scene;
      scene.lights.push_back({"sky", DomeLight{Vec3d(kL), nullptr, 0}});
      Repeated means[3];
      size_t channels = 0;
      for (uint64_t seed = 1; seed <= 8; ++seed) {
        const ReferenceResult result = reference(medium, scene, paths(1e4, seed));
        EXPECT_LT(std::abs(result.energy.closure()), 1e-6);
        channels = result.diffuse.size();
        for (size_t c = 0; c < channels; ++c)
          means[c].values.push_back(
              (meanOf(medium.topology(), result.direct[c]) + meanOf(medium.topology(), result.diffuse[c])) /
              kL);
      }
      EXPECT_EQ(channels, kind ? 3u : 1u);
      for (size_t c = 0; c < channels; ++c) {
        expectMean(means[c], 1,
                   "sigma " + std::to_string(sigma) + " kind " + std::to_string(kind) + " channel " +
                       std::to_string(c));
        EXPECT_LT(means[c].error(), 0.01);
      }
    }
}

/// Over the voxels: squares of differences, of five standard errors and more, and what variances they have.
struct Spread {
  double excess = 0, variance = 0, beyond = 0;
};

Spread spreadOf(const Medium& medium, const ReferenceResult& a, size_t channel, const ReferenceResult& b,
                size_t other) {
  Spread s;
  forEachVoxel(medium.topology(), [&](Coord, size_t i) {
    const double variance = std::pow(a.diffuse_se[channel][i], 2) + std::pow(b.diffuse_se[other][i], 2);
    const double d = a.diffuse[channel][i] - b.diffuse[other][i];
    s.excess += d * d;
    s.variance += variance;
    s.beyond += d * d > 25 * variance;
  });
  return s;
}

void expectSame(const Spread& s, const std::string& what) {
  EXPECT_LT(s.excess, 1.5 * s.variance) << what;
  EXPECT_GT(s.excess, 0.5 * s.variance) << what;
  EXPECT_LE(s.beyond, 1) << what << ": voxels beyond five standard errors";
}

TEST(ReferenceAlbedo, OneValueEverywhereIsThatAlbedo) {
  constexpr double kA = 0.6;
  for (const bool coloured : {false, true}) {
    Medium with = lump(2, coloured ? Vec3d(1, 0.6, 0.3) : Vec3d(1), 0.4);
    with.optics.sigma_a = Vec3d(0.1);
    setEmission(with, [](Coord p) { return 0.2 * hashed(p); });
    Medium without = with;
    setAlbedo(with, [](Coord, int) { return kA; });
    without.optics.sigma_s *= kA;
    without.optics.sigma_a += with.optics.sigma_s * (1 - kA);
    const Scene sun = sunScene(Vec3d(0.2, 0.3, -1));
    const ReferenceResult a = reference(with, sun, paths(1 << 17)),
                          b = reference(without, sun, paths(1 << 17, 2));
    ASSERT_EQ(a.diffuse.size(), coloured ? 3u : 1u);
    for (size_t c = 0; c < a.diffuse.size(); ++c)
      expectSame(spreadOf(with, a, c, b, c), "channel " + std::to_string(c));
    const double in = b.energy.scattered_in + b.energy.emitted;
    EXPECT_NEAR(a.energy.scattered_in, b.energy.scattered_in, 0.01 * in);
    EXPECT_NEAR(a.energy.emitted, b.energy.emitted, 0.01 * in);
    EXPECT_NEAR(a.energy.absorbed, b.energy.absorbed, 0.01 * in);
  }
}

TEST(ReferenceAlbedo, EachColourIsThatColourAlone) {
  const auto a = [](const Coord& p, int c) {
    return c == 0 ? hashed(p, 5) : c == 1 ? (p[2] < 6 ? 1 : 0.1) : 0;
  };
  Medium all = lump(2, Vec3d(1), 0), one = all;
  setAlbedo(all, a, 3);
  const Scene sun = sunScene(Vec3d(0.2, 0.3, -1));
  const ReferenceResult together = reference(all, sun, paths(1 << 17));
  ASSERT_EQ(together.diffuse.size(), 3u);
  for (const int c : {0, 1}) {
    setAlbedo(one, [&](Coord p, int) { return a(p, c); });
    expectSame(spreadOf(all, together, c, reference(one, sun, paths(1 << 17, 2)), 0),
               "channel " + std::to_string(c));
  }
  EXPECT_EQ(meanOf(all.topology(), together.diffuse[2]), 0);
}

}  // namespace
}  // namespace vdb_diffuse
