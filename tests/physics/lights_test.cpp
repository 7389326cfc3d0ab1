#include <gtest/gtest.h>

#include "diffusion/diffuse.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

constexpr double kInverseSphere = 1 / (4 * M_PI);

template <typename AnyLight>
Scene only(const AnyLight& light) {
  Scene scene;
  scene.lights.push_back({"light", light});
  return scene;
}

/// A box around the origin that hides nothing.
Medium thinBox(int n, double h) {
  return boxMedium(
      Coord(n), Transform::uniform(h), [](Coord) { return 1e-7; }, Coord(-n / 2));
}

Field<float> directIn(const Medium& medium, const Scene& scene) {
  return firstScatter(medium, scene, Occluder(scene.surfaces), Model::kP1).direct[0];
}

// All that a lamp emits scatters or is absorbed in a box that is large enough: 4 pi I.
TEST(Lamp, InsideTheMediumGivesAllItsLight) {
  for (double tau : {0.3, 1.0}) {                  // of a voxel
    const int n = static_cast<int>(16 / tau) | 1;  // 8 mean free paths to each side
    const double h = 0.25, sigma = tau / h;
    Medium medium = boxMedium(
        Coord(n), Transform::uniform(h), [](Coord) { return 1.0; }, Coord(-n / 2));
    medium.optics.sigma_s = Vec3d(0.75 * sigma);
    medium.optics.sigma_a = Vec3d(0.25 * sigma);
    for (const Vec3d& at :
         {Vec3d(0, 0, 0), Vec3d(0.5, 0.5, 0.5), Vec3d(0.5, 0, 0), Vec3d(0.31, -0.17, 0.44)}) {
      const Field<float> direct = directIn(medium, only(PointLight{at * h, Vec3d(2), 0}));
      double power = 0;
      forEachVoxel(medium.topology(), [&](Coord, size_t i) {
        ASSERT_TRUE(std::isfinite(direct[i]));
        power += direct[i];
      });
      power *= 4 * M_PI * sigma * h * h * h;
      EXPECT_NEAR(power / (4 * M_PI * 2), 1, 0.01) << "optical depth " << tau << " lamp at " << at;
    }
  }
}

TEST(Lamp, FallsWithTheSquareOfTheDistance) {
  const double h = 0.5;
  const Medium medium = thinBox(24, h);
  for (const Vec3d& lamp : {Vec3d(0), Vec3d(0.1, 0.2, -0.15), Vec3d(20, 3, 1)}) {
    const Field<float> direct = directIn(medium, only(PointLight{lamp, Vec3d(7), 0}));
    forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
      const Vec3d d = p.asVec3d() * h - lamp;
      if (d.length() < 1.5 * h) return;
      double mean = 0;  // of 1/r^2 over the voxel
      for (int s = 0; s < 64; ++s) {
        const Vec3d at = d + Vec3d((s & 3) - 1.5, (s >> 2 & 3) - 1.5, (s >> 4) - 1.5) * (h / 4);
        mean += 1 / (64 * at.lengthSqr());
      }
      ASSERT_NEAR(direct[i], 7 * kInverseSphere * mean, 0.02 * direct[i]) << p << lamp;
      if (d.length() > 5 * h) {
        ASSERT_NEAR(direct[i], 7 * kInverseSphere * mean, 1e-3 * direct[i]) << p << lamp;
      }
    });
  }
}

TEST(Lamp, BallFarAwayIsAPoint) {
  const Medium medium = thinBox(8, 0.5);
  const Vec3d far(30, -20, 10);
  const Field<float> point = directIn(medium, only(PointLight{far, Vec3d(7), 0})),
                     ball = directIn(medium, only(PointLight{far, Vec3d(7), 2}));
  EXPECT_LT(largestDifference(medium.topology(), ball, point), 0.01);  // (2 / 37)^2 of it
}

TEST(Spot, IsAPointWithinItsConeAndNothingOutside) {
  const Medium medium = thinBox(16, 0.5);
  const Vec3d at(0, 0, 8);
  SpotLight spot;
  spot.position = at;
  spot.direction = Vec3d(0, 0, -1);
  spot.intensity = Vec3d(7);
  spot.angle = 0.6;
  spot.blend = 0.2;
  const Field<float> direct = directIn(medium, only(spot)),
                     point = directIn(medium, only(PointLight{at, Vec3d(7), 0}));
  const double outer = std::cos(0.3), inner = outer + 0.2 * (1 - outer);
  int bright = 0, dark = 0;
  forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
    const Vec3d d = (p.asVec3d() * 0.5 - at).unit();
    if (-d[2] > inner + 1e-6) {
      ASSERT_EQ(direct[i], point[i]) << p;
      ++bright;
    } else if (-d[2] < outer - 1e-6) {
      ASSERT_EQ(direct[i], 0) << p;
      ++dark;
    } else {
      ASSERT_LE(direct[i], point[i]) << p;
    }
  });
  EXPECT_GT(bright, 100);
  EXPECT_GT(dark, 100);
}

// A radiance L over an area A shines L A cos(angle) from its front.
TEST(AreaLamp, FarAwayIsAPointOfItsPower) {
  const Medium medium = thinBox(8, 0.5);
  const Mesh mesh = quad(Vec3d(-1, 40, -1.5), Vec3d(0, 0, 3), Vec3d(2, 0, 0));  // its front looks to +y
  Mesh turned = mesh;
  for (auto& t : turned.triangles) std::swap(t[1], t[2]);
  const Field<float> back = directIn(medium, only(AreaLight{mesh, Vec3d(5)})),
                     front = directIn(medium, only(AreaLight{turned, Vec3d(5)})),
                     point = directIn(medium, only(PointLight{Vec3d(0, 40, 0), Vec3d(30), 0}));
  EXPECT_LT(largestDifference(medium.topology(), front, point), 0.01);
  forEachVoxel(medium.topology(), [&](Coord, size_t i) { ASSERT_EQ(back[i], 0); });
}

// Radiance L = E / (pi sin^2 a) from a disc of angular radius a: the mean over directions is L (1 - cos a)
// / 2.
TEST(Sun, WideSunKeepsItsIrradiance) {
  const Medium medium = thinBox(4, 0.5);
  const Vec3d d = Vec3d(1, 2, -3).unit();
  const auto mean = [&](double angle) {
    return directIn(medium, only(SunLight{d, Vec3d(4), angle})).at(medium.topology(), Coord(0));
  };
  EXPECT_NEAR(mean(0), 4 * kInverseSphere, 1e-6);
  EXPECT_NEAR(mean(0.0093), 4 * kInverseSphere, 1e-5);
  for (double angle : {0.1, 0.5, 1.5}) {
    const double a = 0.5 * angle, L = 4 / (M_PI * std::sin(a) * std::sin(a));
    EXPECT_NEAR(mean(angle), 0.5 * L * (1 - std::cos(a)), 1e-5) << angle;
  }
}

TEST(Dome, UniformSkyHasItsRadianceFromAllSides) {
  const Medium medium = thinBox(4, 0.5);
  FirstScatterSettings settings;
  settings.want_flux = true;
  const FirstScatter light =
      firstScatter(medium, only(DomeLight{Vec3d(3), nullptr, 0}), Occluder({}), Model::kP1, settings);
  forEachVoxel(medium.topology(), [&](Coord, size_t i) {
    ASSERT_NEAR(light.direct[0][i], 3, 1e-5);
    for (const Field<float>& component : light.beam_flux[0]) ASSERT_NEAR(component[i], 0, 0.03);
  });
}

TEST(Colour, OfTheLightScalesTheChannelsOfAGreyMedium) {
  Medium medium =
      boxMedium(Coord(14, 15, 16), Transform::uniform(0.4), [](Coord p) { return lumpyDensity(p); });
  medium.optics.sigma_s = Vec3d(1.2);
  medium.optics.sigma_a = Vec3d(0.1);
  medium.optics.g = 0.5;
  DiffuseSettings settings;
  settings.tolerance = 1e-7;
  const Vec3d d(0.1, 0.2, -1), colour(1, 0.3, 5);
  const DiffuseResult grey = diffuse(medium, sunScene(d), settings),
                      coloured = diffuse(medium, sunScene(d, colour), settings);
  ASSERT_EQ(grey.diffuse.size(), 1u);
  ASSERT_EQ(coloured.diffuse.size(), 3u);
  double luminance = 0;
  for (int c = 0; c < 3; ++c) {
    luminance += kLuminance[c] * colour[c];
    forEachVoxel(medium.topology(), [&](Coord, size_t i) {
      ASSERT_NEAR(coloured.diffuse[c][i], colour[c] * grey.diffuse[0][i], 1e-5 * colour[c] * kInverseSphere);
      ASSERT_NEAR(coloured.direct[c][i], colour[c] * grey.direct[0][i], 1e-6 * colour[c] * kInverseSphere);
    });
  }
  EXPECT_NEAR(coloured.energy.escaped, luminance * grey.energy.escaped, 1e-5 * coloured.energy.escaped);
  // A coloured medium under grey light is three grey ones.
  medium.optics.sigma_s = Vec3d(0.5, 1, 2);
  medium.optics.sigma_a = Vec3d(0, 0.1, 0.3);
  const DiffuseResult three = diffuse(medium, sunScene(d), settings);
  for (int c = 0; c < 3; ++c) {
    Medium one = medium;
    one.optics.sigma_s = Vec3d(medium.optics.sigma_s[c]);
    one.optics.sigma_a = Vec3d(medium.optics.sigma_a[c]);
    const DiffuseResult alone = diffuse(one, sunScene(d), settings);
    EXPECT_LT(largestDifference(medium.topology(), three.diffuse[c], alone.diffuse[0]), 1e-6) << c;
  }
}

}  // namespace
}  // namespace vdb_diffuse
