#include <gtest/gtest.h>

#include "diffusion/diffuse.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

// The radiances are linear in the lights, and the matrix is symmetric.

Medium cloud(double g) {
  Medium medium =
      boxMedium(Coord(20, 17, 19), Transform::uniform(0.3), [](Coord p) { return lumpyDensity(p); });
  medium.optics.sigma_s = Vec3d(1.5);
  medium.optics.sigma_a = Vec3d(0.05);
  medium.optics.g = g;
  return medium;
}

DiffuseSettings tight() {
  DiffuseSettings settings;
  settings.tolerance = 1e-7;
  return settings;
}

/// Largest |a - factor b| over the largest |factor b|, in all channels.
double difference(const Medium& medium, const Channels& a, const Channels& b, double factor = 1) {
  if (a.size() != b.size()) return HUGE_VAL;
  double worst = 0, largest = 0;
  for (size_t c = 0; c < a.size(); ++c)
    forEachVoxel(medium.topology(), [&](Coord, size_t i) {
      worst = std::max(worst, std::abs(a[c][i] - factor * b[c][i]));
      largest = std::max(largest, std::abs(factor * b[c][i]));
    });
  return worst / largest;
}

Channels sum(Channels a, const Channels& b) {
  for (size_t c = 0; c < a.size(); ++c)
    for (size_t i = 0; i < a[c].size(); ++i) a[c][i] += b[c][i];
  return a;
}

void expectSuperposition(const Scene& a, const Scene& b, const char* what) {
  Scene both = a;
  both.lights.insert(both.lights.end(), b.lights.begin(), b.lights.end());
  Scene swapped = b;
  swapped.lights.insert(swapped.lights.end(), a.lights.begin(), a.lights.end());
  for (double g : {0.0, 0.6}) {
    const Medium medium = cloud(g);
    const DiffuseResult one = diffuse(medium, a, tight()), two = diffuse(medium, b, tight());
    for (const Scene* scene : {&both, &swapped}) {
      const DiffuseResult all = diffuse(medium, *scene, tight());
      EXPECT_LT(difference(medium, all.direct, sum(one.direct, two.direct)), 1e-6) << what << ", g " << g;
      EXPECT_LT(difference(medium, all.diffuse, sum(one.diffuse, two.diffuse)), 1e-5) << what << ", g " << g;
    }
  }
}

TEST(Superposition, OfSunAndLamp) {
  Scene lamp;
  lamp.lights.push_back({"lamp", PointLight{Vec3d(2.5, 2, 7), Vec3d(30), 0}});
  expectSuperposition(sunScene(Vec3d(0.2, -0.4, -1)), lamp, "sun and lamp");
}

TEST(Superposition, OfSunAndSky) {
  Scene sky;
  sky.lights.push_back({"sky", DomeLight{Vec3d(0.1), nullptr, 0}});
  expectSuperposition(sunScene(Vec3d(0.2, -0.4, -1)), sky, "sun and sky");
}

TEST(Superposition, OfLampAndEmission) {
  Medium glowing = cloud(0.6), dark = cloud(0.6);
  setEmission(glowing, [](Coord p) { return 5 * hashed(p, 3); });
  Scene lamp;
  lamp.lights.push_back({"lamp", PointLight{Vec3d(2.5, 2, 7), Vec3d(30), 0}});
  const DiffuseResult both = diffuse(glowing, lamp, tight()), emission = diffuse(glowing, {}, tight()),
                      lit = diffuse(dark, lamp, tight());
  EXPECT_LT(difference(dark, both.diffuse, sum(emission.diffuse, lit.diffuse)), 1e-5);
  EXPECT_NEAR(both.energy.escaped, emission.energy.escaped + lit.energy.escaped, 1e-5 * both.energy.escaped);
}

TEST(Scale, PowersOfTwoChangeNoBit) {
  Medium medium = cloud(0.6);
  setEmission(medium, [](Coord p) { return hashed(p, 3); });
  const Vec3d d(0.2, -0.4, -1);
  const DiffuseResult one = diffuse(medium, sunScene(d));
  for (int exponent : {-100, -66, 1, 66, 100}) {  // 1e-30 .. 1e30
    const double factor = std::ldexp(1.0, exponent);
    medium.optics.emission_scale = factor;
    const DiffuseResult scaled = diffuse(medium, sunScene(d, Vec3d(factor)));
    EXPECT_EQ(difference(medium, scaled.diffuse, one.diffuse, factor), 0) << "2^" << exponent;
    EXPECT_EQ(difference(medium, scaled.direct, one.direct, factor), 0) << "2^" << exponent;
    EXPECT_EQ(scaled.energy.escaped, one.energy.escaped * factor) << "2^" << exponent;
    EXPECT_EQ(scaled.iterations, one.iterations);
  }
}

TEST(Scale, PowersOfTenChangeRoundingAlone) {
  const Medium medium = cloud(0);
  const Vec3d d(0, 0, -1);
  const DiffuseResult one = diffuse(medium, sunScene(d), tight());
  for (double factor : {1e-20, 1e-3, 1e20}) {
    const DiffuseResult scaled = diffuse(medium, sunScene(d, Vec3d(factor)), tight());
    EXPECT_LT(difference(medium, scaled.diffuse, one.diffuse, factor), 1e-5) << factor;
    EXPECT_NEAR(scaled.energy.absorbed, factor * one.energy.absorbed, 1e-5 * scaled.energy.absorbed);
  }
}

// One watt emitted in a voxel and seen in another is as bright as the other way round. A voxel emits
// sigma_a rho Q per volume.
TEST(Reciprocity, SourceAndReceiverMayBeSwapped) {
  for (double g : {0.0, 0.6}) {
    Medium medium = cloud(g);
    std::vector<Coord> voxels;
    forEachVoxel(medium.topology(), [&](Coord p, size_t) {
      const bool near = p[0] >= 6 && p[0] < 14 && p[1] >= 5 && p[1] < 13 && p[2] >= 6 && p[2] < 14;
      if (near && hashed(p, 9) < 0.05) voxels.push_back(p);
    });
    ASSERT_GE(voxels.size(), 4u);
    voxels.resize(4);
    const auto rho = [&](Coord p) { return medium.density.values.at(medium.topology(), p); };
    double seen[4][4];
    for (int from = 0; from < 4; ++from) {
      setEmission(medium, [&](Coord p) { return p == voxels[from] ? 1.0 / rho(p) : 0.0; });
      const DiffuseResult result = diffuse(medium, {}, tight());
      for (int to = 0; to < 4; ++to) seen[from][to] = result.diffuse[0].at(medium.topology(), voxels[to]);
    }
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < a; ++b) {
        EXPECT_GT(seen[a][b], 0);
        EXPECT_NEAR(seen[a][b], seen[b][a], 1e-4 * seen[a][b]) << "g " << g << voxels[a] << voxels[b];
      }
  }
}

}  // namespace
}  // namespace vdb_diffuse
