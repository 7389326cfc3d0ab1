#include "transport/tints.h"

#include <gtest/gtest.h>

#include "transport/illuminate.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

constexpr double kTolerance = 1e-6;
const Vec3d kWarm(1, 0.5, 0.25), kCold(0.25, 0.5, 2);

Medium glowingBall() {
  Medium medium = ballMedium(1, 0.125);
  medium.optics.sigma_s = Vec3d(3);
  medium.optics.sigma_a = Vec3d(0.5);
  medium.optics.g = 0.5;
  medium.emission.push_back(medium.density.values);
  return medium;
}

std::vector<NamedLight> lamps() {
  return {{"sun", SunLight{Vec3d(1, 0.5, -1).unit(), kWarm}}, {"lamp", PointLight{Vec3d(0, 0, 3), kCold}}};
}

DiffuseSettings tight() {
  DiffuseSettings settings;
  settings.tolerance = kTolerance;
  settings.want_flux = true;
  return settings;
}

TransportSettings sweeps(int count) {
  TransportSettings transport;
  transport.sweeps = count;
  return transport;
}

void expectSame(const Medium& medium, const DiffuseResult& a, const DiffuseResult& b, double tolerance) {
  ASSERT_EQ(a.diffuse.size(), b.diffuse.size());
  for (size_t c = 0; c < a.diffuse.size(); ++c) {
    EXPECT_LT(largestDifference(medium.topology(), a.diffuse[c], b.diffuse[c]), tolerance) << c;
    EXPECT_LT(largestDifference(medium.topology(), a.direct[c], b.direct[c]), tolerance) << c;
  }
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_LT(largestDifference(medium.topology(), a.flux[axis], b.flux[axis]), tolerance) << axis;
  EXPECT_NEAR(a.energy.scattered_in, b.energy.scattered_in, tolerance * b.energy.scattered_in);
  EXPECT_NEAR(a.energy.emitted, b.energy.emitted, tolerance * b.energy.emitted);
  EXPECT_NEAR(a.energy.escaped, b.energy.escaped, tolerance * b.energy.escaped);
}

// `diffuse` itself knows no tints: it solves for red, green and blue.
TEST(Tints, LightOfOneColourIsGreyLightTimesIt) {
  Medium medium = glowingBall();
  medium.emission = {};
  const Scene scene{lamps(), {}};
  const DiffuseResult three = diffuse(medium, scene, tight());
  ASSERT_EQ(splitByTint(medium, {}, {"", scene.lights}).size(), 2u);
  expectSame(medium, illuminate(medium, scene, tight(), sweeps(0)), three, 10 * kTolerance);
}

TEST(Tints, TheMediumsOwnLightIsOneOfTheColours) {
  const Medium medium = glowingBall();
  const Scene scene{{lamps().front()}, {}};
  const std::vector<TintedLight> tints = splitByTint(medium, {}, {"", scene.lights});
  ASSERT_EQ(tints.size(), 2u);
  EXPECT_EQ(tints[1].tint, Vec3d(1));
  expectSame(medium, illuminate(medium, scene, tight(), sweeps(0)), diffuse(medium, scene, tight()),
             10 * kTolerance);
}

TEST(Tints, GroupsAddUpToTheWhole) {
  const Medium medium = glowingBall();
  const Scene scene{lamps(), {}};
  const DiffuseResult whole = illuminate(medium, scene, tight(), sweeps(2));
  const std::vector<LightGroup> groups = groupLights(scene, true);
  std::vector<DiffuseResult> parts = illuminate(medium, {}, groups, tight(), sweeps(2));
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_EQ(parts[0].energy.emitted, 0);
  EXPECT_EQ(parts[2].energy.scattered_in, 0);
  EXPECT_GT(parts[2].energy.emitted, 0);
  EXPECT_EQ(parts[2].diffuse.size(), 1u);  // what glows is grey
  DiffuseResult sum = std::move(parts[0]);
  for (size_t g = 1; g < parts.size(); ++g) add(parts[g], sum);
  // Sweeps go from each light's own start, so rounding and tolerances meet twice.
  expectSame(medium, sum, whole, 1e-4);
}

TEST(Tints, AGroupIsWhatItsLightsGiveAlone) {
  const Medium medium = glowingBall();
  const std::vector<LightGroup> groups = groupLights({lamps(), {}}, true);
  const std::vector<DiffuseResult> parts = illuminate(medium, {}, groups, tight(), sweeps(1));
  Medium dark = glowingBall();
  dark.emission = {};
  for (size_t g = 0; g < 2; ++g)
    expectSame(dark, parts[g], illuminate(dark, {groups[g].lights, {}}, tight(), sweeps(1)), 10 * kTolerance);
}

TEST(Tints, ColouredMediaAndSurfacesAreSolvedByChannel) {
  Medium medium = glowingBall();
  const LightGroup group{"", lamps()};
  EXPECT_EQ(splitByTint(medium, {}, group).size(), 0u) << "two lamps and a glow are three colours";
  medium.emission = {};
  EXPECT_EQ(splitByTint(medium, {}, group).size(), 2u);
  EXPECT_TRUE(splitByTint(medium, {{"red", {}, Vec3d(0.5, 0, 0)}}, group).empty());
  medium.optics.sigma_s = Vec3d(1, 2, 3);
  EXPECT_TRUE(splitByTint(medium, {}, group).empty());
}

TEST(Tints, AColouredPictureIsNotSplit) {
  Medium medium = glowingBall();
  medium.emission = {};
  auto image = std::make_shared<Image>(Image{2, 1, {Vec3f(1), Vec3f(1)}});
  const LightGroup sky{"", {{"sky", DomeLight{kWarm, image, 0}}}};
  EXPECT_EQ(splitByTint(medium, {}, sky).size(), 1u);
  image->pixels[1] = Vec3f(1, 0, 0);
  EXPECT_TRUE(splitByTint(medium, {}, sky).empty());
}

}  // namespace
}  // namespace vdb_diffuse
