#include "reference/runs.h"

namespace vdb_diffuse {
namespace {

constexpr double kWide = 1e4;

Mesh ground(double z) {
  return quad(Vec3d(-kWide, -kWide, z), Vec3d(2 * kWide, 0, 0), Vec3d(0, 2 * kWide, 0));
}

Medium cube(double sigma_t, double albedo) {
  Medium medium = boxMedium(
      Coord(8), Transform::uniform(0.5), [](Coord) { return 1.0; }, Coord(-4, -4, 0));
  setOptics(medium, sigma_t, albedo);
  return medium;
}

// A wide plane in the sun has the radiance a E mu / pi and fills half of the directions. Nearly all of it
// lies outside the volume's shadow, and only what is near counts.
TEST(ReferenceSurfaces, WidePlaneInTheSun) {
  const double mu = 0.8, albedo = 0.6, E = 2;
  const Vec3d sun(0.6, 0, -0.8);
  for (double below : {0.2, 2.0}) {
    const Medium medium = cube(1e-9, 0.5);
    Scene scene = sunScene(sun, Vec3d(E));
    scene.surfaces.push_back({"ground", ground(-0.25 - below), Vec3d(albedo)});
    Repeated means;
    for (uint64_t seed = 1; seed <= 8; ++seed)
      means.values.push_back(meanOf(medium.topology(), reference(medium, scene, paths(2e4, seed)).direct[0]));
    expectMean(means, E / (4 * M_PI) + 0.5 * albedo * E * mu / M_PI);
    EXPECT_LT(means.error(), 0.01 * means.mean()) << below;
  }
}

// The ground under a slab that absorbs and does not scatter is lit by exp(-tau / mu), and sends back through
// it the second exponential integral: E2(t), averaged over a layer (E3(t) - E3(t + dt)) / dt.
double exponentialIntegral3(double t) {
  double sum = 0;  // int_0^1 mu exp(-t / mu) dmu
  constexpr int kSteps = 2000;
  for (int n = 0; n < kSteps; ++n) {
    const double mu = (n + 0.5) / kSteps;
    sum += mu * std::exp(-t / mu) / kSteps;
  }
  return sum;
}

TEST(ReferenceSurfaces, GroundUnderAnAbsorbingSlab) {
  constexpr int kLayers = 6;
  constexpr double kSigma = 0.4, kDepth = 3, kMu = 0.7, kAlbedo = 0.5;
  Medium medium = slabMedium(kLayers, kDepth, 1e4, [](int) { return 1.0; });
  setOptics(medium, kSigma, 0);
  Scene scene = sunScene(Vec3d(std::sqrt(1 - kMu * kMu), 0, -kMu));
  scene.surfaces.push_back({"ground", ground(-0.5), Vec3d(kAlbedo)});
  Repeated layer[kLayers];
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    const ReferenceResult result = reference(medium, scene, paths(2e4, seed));
    for (int z = 0; z < kLayers; ++z)
      layer[z].values.push_back(result.direct[0].at(medium.topology(), Coord(0, 0, z)));
    EXPECT_EQ(meanOf(medium.topology(), result.diffuse[0]), 0);
  }
  const double dt = kSigma * kDepth / kLayers, tau = kSigma * kDepth;
  for (int z = 0; z < kLayers; ++z) {
    const double above = tau - (z + 1) * dt, radiance = kAlbedo * kMu * std::exp(-tau / kMu) / M_PI;
    const double sun = std::exp(-above / kMu) * -std::expm1(-dt / kMu) / (dt / kMu) / (4 * M_PI);
    const double back =
        0.5 * radiance * (exponentialIntegral3(z * dt) - exponentialIntegral3((z + 1) * dt)) / dt;
    EXPECT_NEAR(layer[z].mean(), sun + back, 5 * layer[z].error() + 1e-3 * (sun + back)) << z;
    EXPECT_LT(layer[z].error(), 0.01 * layer[z].mean());
  }
}

// In a sky of radiance L over a white ground without end, L is everywhere.
TEST(ReferenceSurfaces, WhiteGroundInAUniformSky) {
  const Medium medium = cube(1.5, 1);
  Scene scene;
  scene.lights.push_back({"sky", DomeLight{Vec3d(2), nullptr, 0}});
  scene.surfaces.push_back({"ground", ground(-0.3), Vec3d(1)});
  Repeated means;
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    const ReferenceResult result = reference(medium, scene, paths(2e4, seed));
    means.values.push_back(
        0.5 * (meanOf(medium.topology(), result.direct[0]) + meanOf(medium.topology(), result.diffuse[0])));
    EXPECT_LT(std::abs(result.energy.closure()), 1e-9);
  }
  expectMean(means, 1);
  EXPECT_LT(means.error(), 0.01);
}

// A black plate throws a shadow with a sharp edge; light that went through the volume before it meets a
// coloured one comes back coloured.
TEST(ReferenceSurfaces, PlatesHideAndColour) {
  const Medium medium = cube(1e-6, 0.5);
  Scene scene = sunScene(Vec3d(0, 0, -1));
  scene.surfaces.push_back({"plate", quad(Vec3d(-0.25, -9, 5), Vec3d(9, 0, 0), Vec3d(0, 18, 0)), Vec3d(0)});
  const ReferenceResult half = reference(medium, scene, paths(2e4));
  forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
    if (p[0] >= 0)
      ASSERT_EQ(half.direct[0][i], 0) << p;
    else
      ASSERT_GT(half.direct[0][i], 0) << p;
  });
  scene.surfaces[0] = {"floor", quad(Vec3d(-9, -9, -1), Vec3d(18, 0, 0), Vec3d(0, 18, 0)), Vec3d(1, 0.5, 0)};
  const ReferenceResult floor = reference(medium, scene, paths(1e5));
  ASSERT_EQ(floor.direct.size(), 3u);
  const double red = meanOf(medium.topology(), floor.direct[0]),
               green = meanOf(medium.topology(), floor.direct[1]),
               blue = meanOf(medium.topology(), floor.direct[2]);
  EXPECT_NEAR(blue, 1 / (4 * M_PI), 1e-3 / (4 * M_PI));
  EXPECT_NEAR((red - blue) / (green - blue), 2, 1e-3);
  EXPECT_GT(red, 1.5 * blue);
}

}  // namespace
}  // namespace vdb_diffuse
