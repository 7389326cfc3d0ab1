#include "diffusion/bounced_light.h"

#include <gtest/gtest.h>

#include <random>

#include "diffusion/first_scatter.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

/// A ball about the world's origin, fronts outside: an octahedron's faces cut into four `cuts` times, the
/// corners as far outside as the middles of the faces lie inside.
Mesh ball(double radius, int cuts) {
  Mesh mesh;
  const auto add = [&](const auto& self, const Vec3d& a, const Vec3d& b, const Vec3d& c, int left) -> void {
    if (left == 0) {
      const auto n = static_cast<uint32_t>(mesh.positions.size());
      for (const Vec3d& p : {a, b, c}) mesh.positions.push_back(p * radius);
      mesh.triangles.push_back({n, n + 1, n + 2});
      return;
    }
    const Vec3d ab = (a + b).unit(), bc = (b + c).unit(), ca = (c + a).unit();
    self(self, a, ab, ca, left - 1);
    self(self, ab, b, bc, left - 1);
    self(self, ca, bc, c, left - 1);
    self(self, ab, bc, ca, left - 1);
  };
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d x(corner & 1 ? 1 : -1, 0, 0), y(0, corner & 2 ? 1 : -1, 0), z(0, 0, corner & 4 ? 1 : -1);
    if (x[0] * y[1] * z[2] > 0)
      add(add, x, y, z, cuts);
    else
      add(add, x, z, y, cuts);
  }
  const Vec3d middle = (mesh.positions[0] + mesh.positions[1] + mesh.positions[2]) / 3;
  for (Vec3d& p : mesh.positions) p *= 2 * radius / (radius + middle.length());
  return mesh;
}

/// A cube of 2n voxels of side h about the world's origin.
Medium cubeAbout(int n, double h) {
  return boxMedium(
      Coord(2 * n), Transform::uniform(h, Vec3d(0.5 * h)), [](Coord) { return 1.0; }, Coord(-n));
}

TwofoldLight constantLight(const Occluder::Hit&, const Vec3d&, const Vec3d&) {
  return {Vec3d(1, 2, 0), Vec3d(1, 2, 0)};
}

// In a closed room whose walls all throw back the radiance L of a light, they get pi L, then pi L R, ...: the
// sum is pi L / (1 - R).
TEST(BouncedLight, SumsTheBouncesInAClosedRoom) {
  Medium medium = cubeAbout(4, 0.1);
  medium.optics.sigma_s = Vec3d(1e-9);
  for (const double R : {0.1, 0.8, 0.98}) {
    Scene scene;
    scene.surfaces.push_back({"room", ball(3, 3), Vec3d(R, 0.5 * R, R)});
    const Occluder occluder(scene.surfaces);
    const BeamMedium beams(medium, Model::kDefault, 1);
    const BouncedLight light(beams, scene.surfaces, occluder, constantLight);
    const Vec3d p = scene.surfaces[0].mesh.positions[15];
    const SurfacePoint inner{p, -p.unit()};
    const TwofoldLight E = light.irradiance(0, 5, false, inner);
    EXPECT_NEAR(E.direct[0], M_PI / (1 - R), 1e-3 * M_PI / (1 - R)) << R;
    EXPECT_NEAR(E.direct[1], 2 * M_PI / (1 - 0.5 * R), 1e-3 * 2 * M_PI / (1 - 0.5 * R)) << R;
    EXPECT_EQ(E.direct[2], 0);
    EXPECT_EQ(E.beam, E.direct);
    // R^n / (1 - R) of the first light is left after n bounces.
    EXPECT_LT(light.bounces(), 4 + std::log(1e-3 * (1 - R)) / std::log(R)) << R;
    EXPECT_EQ(light.irradiance(0, 5, true, {inner.p, -inner.normal}).direct, Vec3d(0)) << "nothing outside";
  }
}

// Surfaces that do not see each other: light bounces nowhere.
TEST(BouncedLight, IsNothingAboveAPlane) {
  Medium medium = cubeAbout(4, 0.1);
  Scene scene;
  scene.surfaces.push_back(
      {"ground", quad(Vec3d(-1e4, -1e4, -1), Vec3d(2e4, 0, 0), Vec3d(0, 2e4, 0)), Vec3d(1)});
  scene.surfaces.push_back({"black", quad(Vec3d(-2, -2, 2), Vec3d(4, 0, 0), Vec3d(0, 4, 0)), Vec3d(0)});
  const Occluder occluder(scene.surfaces);
  const BeamMedium beams(medium, Model::kDefault, 1);
  const BouncedLight light(beams, scene.surfaces, occluder, constantLight);
  EXPECT_EQ(light.bounces(), 0);
  EXPECT_EQ(light.irradiance(0, 0, true, {Vec3d(0, 0, -1), Vec3d(0, 0, 1)}).direct, Vec3d(0));
}

// A lamp of intensity I amid a ball of radius r that is filled with a medium of extinction s: its wall gets
// E = I exp(-s r) / r^2 of the lamp. A chord at the angle acos(c) to the normal is 2 r c long, so that of the
// light that the wall throws back it gets again the share R T,
//
//     T = int_0^1 exp(-2 s r c) 2 c dc = 2 (1 - (1 + t) exp(-t)) / t^2,    t = 2 s r
//
// and the middle sees the radiance R E / (1 - R T) / pi through exp(-s r). By channel, and for the rescaled
// medium too.
TEST(BouncedLight, IntegratingBallFilledWithAMedium) {
  constexpr double kRadius = 1, kIntensity = 5;
  const Vec3d albedo(0.9, 0.6, 0.2);
  Medium medium = cubeAbout(12, 0.1);
  medium.optics.sigma_s = Vec3d(0.2, 0.5, 1.0);
  medium.optics.sigma_a = Vec3d(0.01, 0.2, 0);
  medium.optics.g = 0.8;
  Scene black;
  black.lights.push_back({"lamp", PointLight{Vec3d(0), Vec3d(kIntensity), 0}});
  black.surfaces.push_back({"ball", ball(kRadius, 4), Vec3d(0)});
  Scene bright = black;
  bright.surfaces[0].albedo = albedo;
  const auto light = [&](const Scene& scene) {
    return firstScatter(medium, scene, Occluder(scene.surfaces), Model::kDefault);
  };
  const FirstScatter with = light(bright), without = light(black);
  ASSERT_EQ(with.beam.size(), 3u);
  for (int c = 0; c < 3; ++c) {
    const size_t one = without.direct.size() == 1 ? 0 : static_cast<size_t>(c);
    const auto expectWalls = [&](const Field<float>& field, const Field<float>& lamp, double s) {
      double seen = 0;
      for (int corner = 0; corner < 8; ++corner) {
        const Coord p(corner & 1 ? 0 : -1, corner & 2 ? 0 : -1, corner & 4 ? 0 : -1);
        seen += (field.at(medium.topology(), p) - lamp.at(medium.topology(), p)) / 8;
      }
      const double t = 2 * s * kRadius, T = 2 * (1 - (1 + t) * std::exp(-t)) / (t * t);
      const double E = kIntensity * std::exp(-s * kRadius) / (kRadius * kRadius);
      const double expected = albedo[c] * E / (1 - albedo[c] * T) / M_PI * std::exp(-s * kRadius);
      EXPECT_NEAR(seen / expected, 1, 0.015) << c << ' ' << s;
    };
    const ChannelOptics optics = channelOptics(medium.optics, c, Model::kDefault, 1);
    expectWalls(with.direct[c], without.direct[one], optics.true_sigma_t);
    expectWalls(with.beam[c], without.beam[one], optics.sigma_t_beam);
  }
}

// In a white pit under a sky of radiance L, light of the radiance L comes from everywhere, after as many
// bounces as it needs.
TEST(BouncedLight, FurnaceInAWhitePit) {
  constexpr double kSky = 3;
  Medium medium = cubeAbout(5, 0.1);
  medium.optics.sigma_s = Vec3d(1e-9);
  Scene scene;
  scene.lights.push_back({"sky", DomeLight{Vec3d(kSky), nullptr, 0}});
  const auto wall = [&](const Vec3d& p, const Vec3d& u, const Vec3d& v) {
    scene.surfaces.push_back({"wall", quad(p, u, v), Vec3d(1)});
  };
  const Vec3d x(1.5, 0, 0), y(0, 1.5, 0), z(0, 0, 2.2), low(-0.75, -0.75, -1);
  wall(low, x, y);
  wall(low, x, z);
  wall(low, y, z);
  wall(low + y, x, z);
  wall(low + x, y, z);
  FirstScatterSettings settings;
  settings.lights.dome_directions = 400;
  settings.gather_directions = 400;
  const FirstScatter light = firstScatter(medium, scene, Occluder(scene.surfaces), Model::kDefault, settings);
  for (int z : {-5, -2, 0, 4}) {
    double sum = 0;
    for (int x = -5; x < 5; ++x)
      for (int y = -5; y < 5; ++y) sum += light.direct[0].at(medium.topology(), Coord(x, y, z));
    EXPECT_NEAR(sum / 100, kSky, 0.03 * kSky) << z;
  }
}

/// Small triangles without order about the world's origin, white.
Surface foliage(uint32_t count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> at(-0.8, 0.8), off(-0.05, 0.05);
  Mesh leaves;
  for (uint32_t leaf = 0; leaf < count; ++leaf) {
    const Vec3d middle(at(random), at(random), at(random));
    for (int corner = 0; corner < 3; ++corner)
      leaves.positions.push_back(middle + Vec3d(off(random), off(random), off(random)));
    leaves.triangles.push_back({3 * leaf, 3 * leaf + 1, 3 * leaf + 2});
  }
  return {"leaves", leaves, Vec3d(1)};
}

// So it does among white leaves, whose many sides are more than patches are kept for.
TEST(BouncedLight, FurnaceAmongWhiteLeaves) {
  constexpr double kSky = 3;
  Medium medium = cubeAbout(5, 0.1);
  medium.optics.sigma_s = Vec3d(1e-9);
  Scene scene;
  scene.lights.push_back({"sky", DomeLight{Vec3d(kSky), nullptr, 0}});
  scene.surfaces.push_back(foliage(8000));
  const FirstScatter light = firstScatter(medium, scene, Occluder(scene.surfaces), Model::kDefault);
  double sum = 0;
  for (int z = -5; z < 5; ++z) {
    double layer = 0;
    for (int x = -5; x < 5; ++x)
      for (int y = -5; y < 5; ++y) layer += light.direct[0].at(medium.topology(), Coord(x, y, z));
    EXPECT_NEAR(layer / 100, kSky, 0.05 * kSky) << z;
    sum += layer / 1000;
  }
  EXPECT_NEAR(sum, kSky, 0.02 * kSky);
}

TEST(BouncedLight, KeepsNoMorePatchesForMoreLeaves) {
  Medium medium = cubeAbout(20, 0.025);
  medium.optics.sigma_s = Vec3d(1e-9);
  for (const uint32_t leaves : {8000u, 40000u}) {
    const std::vector<Surface> surfaces{foliage(leaves)};
    const Occluder occluder(surfaces);
    const BeamMedium beams(medium, Model::kDefault, 1);
    const BouncedLight light(beams, surfaces, occluder, constantLight);
    EXPECT_LT(light.patches(), 40000u) << leaves;
    EXPECT_GT(light.bounces(), 0) << leaves;
  }
}

}  // namespace
}  // namespace vdb_diffuse
