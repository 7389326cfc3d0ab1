#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "reference/path_tracer.h"
#include "transport/illuminate.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

constexpr double kTolerance = 1e-5;

DiffuseResult swept(const Medium& medium, const Scene& scene, int sweeps) {
  DiffuseSettings settings;
  settings.tolerance = kTolerance;
  TransportSettings transport;
  transport.sweeps = sweeps;
  transport.directions = transport.fine_directions;  // the same with and without a bright ground
  const DiffuseResult result = illuminate(medium, scene, settings, transport);
  EXPECT_TRUE(result.converged);
  EXPECT_LT(std::abs(result.energy.closure()), 10 * kTolerance);
  return result;
}

Surface ground(double z, double albedo, double reach = 200) {
  return {"ground", quad(Vec3d(-reach, -reach, z), Vec3d(2 * reach, 0, 0), Vec3d(0, 2 * reach, 0)),
          Vec3d(albedo)};
}

/// Balls of radius 1 about the given centres, of density 1, in voxels of side 1/n.
Medium balls(const std::vector<Vec3d>& centres, int n) {
  std::vector<Coord> middles;
  for (const Vec3d& c : centres) middles.push_back(Coord::floor(c * n));
  Coord low = middles[0], high = middles[0];
  for (const Coord& c : middles) {
    low.minComponent(c);
    high.maxComponent(c);
  }
  low -= Coord(n + 1);
  Medium medium = boxMedium(
      high - low + Coord(n + 2), Transform::uniform(1.0 / n, Vec3d(0.5 / n)),
      [&](Coord p) {
        for (const Coord& c : middles)
          if ((p + low - c).asVec3d().length() < n - 0.3) return 1.0;
        return -1.0;
      },
      low);
  return medium;
}

double meanOf(const Medium& medium, const Field<float>& f, const std::function<bool(Coord)>& where) {
  double sum = 0, count = 0;
  forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
    if (!where(p)) return;
    sum += f[i];
    ++count;
  });
  return sum / count;
}
const auto everywhere = [](Coord) { return true; };

/// Mean intensity that ground of albedo 0.8 at a depth H sends back to a glowing ball of power P, so thin
/// that its light passes, over the exact one: of what falls on the ground, P cos / (4 pi r^2), the share R
/// comes back as R P / (32 pi^2 H^2).
double returnedOverExact(double H) {
  Medium medium = balls({Vec3d(0)}, 6);
  medium.optics.sigma_s = Vec3d(1e-6);
  medium.optics.sigma_a = Vec3d(1e-3);
  setEmission(medium, [](Coord) { return 1e3; });
  Scene black, bright;
  black.surfaces.push_back(ground(-H, 0));
  bright.surfaces.push_back(ground(-H, 0.8));
  const double returned = meanOf(medium, swept(medium, bright, 2).diffuse[0], everywhere) -
                          meanOf(medium, swept(medium, black, 2).diffuse[0], everywhere);
  const double P = 4 * M_PI * medium.topology().activeVoxelCount() * medium.transform().voxelVolume();
  return returned * 32 * M_PI * M_PI * H * H / (0.8 * P);
}

TEST(Surfaces, GroundSendsBackWhatTheInverseSquareLawSays) {
  EXPECT_NEAR(returnedOverExact(2.5), 1, 0.05);
}

// Far away the directions of a sweep light spots with gaps between them, and the ball looks just at the
// spots: too much comes back of the little that does (R^2 / (2 H^2) of the ball's own light).
TEST(Surfaces, FarGroundSendsBackTooMuchByALittle) {
  for (const double H : {5.0, 20.0}) {
    EXPECT_GT(returnedOverExact(H), 0.8) << H;
    EXPECT_LT(returnedOverExact(H), 2) << H;
  }
}

// A medium that only scatters, over white ground under a sky of radiance L, has the radiance L everywhere.
TEST(Surfaces, FurnaceOverWhiteGround) {
  Medium medium = balls({Vec3d(0)}, 8);
  medium.optics.sigma_s = Vec3d(2);
  Scene scene;
  scene.lights.push_back({"sky", DomeLight{Vec3d(3), nullptr, 0}});
  scene.surfaces.push_back(ground(-1.5, 1));
  for (int sweeps : {1, 4}) {
    const DiffuseResult result = swept(medium, scene, sweeps);
    const auto departs = [&](int up) {
      const auto half = [&](Coord p) { return (p[2] > 0 ? 1 : -1) == up; };
      return (meanOf(medium, result.diffuse[0], half) + meanOf(medium, result.direct[0], half)) / 3 - 1;
    };
    EXPECT_NEAR(departs(1), 0, 0.02) << sweeps;
    EXPECT_NEAR(departs(-1), 0, 0.02) << sweeps;
  }
}

// Two balls see each other, unless a plate stands between them that is much thinner than a voxel.
TEST(Surfaces, BlackPlatePartsTwoBalls) {
  Medium medium = balls({Vec3d(0), Vec3d(2.5, 1.5, 0.5)}, 6);
  medium.optics.sigma_s = Vec3d(3);
  medium.optics.sigma_a = Vec3d(0.5);
  setEmission(medium, [](Coord p) { return p[0] < 7 ? 1 : 0; });
  const auto other = [](Coord p) { return p[0] >= 7; };
  const Vec3d normal = Vec3d(2.5, 1.5, 0.5).unit(), u = Vec3d(0, 0, 1).cross(normal).unit(),
              v = normal.cross(u);
  Scene parted;
  parted.surfaces.push_back(
      {"plate", quad(Vec3d(1.25, 0.75, 0.25) - u * 30 - v * 30, u * 60, v * 60), Vec3d(0)});
  const DiffuseResult open = swept(medium, {}, 2), shut = swept(medium, parted, 2);
  const double seen = meanOf(medium, open.diffuse[0], other);
  EXPECT_GT(seen, 0.003);
  EXPECT_LT(meanOf(medium, shut.diffuse[0], other), 1e-4 * seen);
}

// More plates in a voxel than a ray asks for: light comes back from the first, and goes through none.
TEST(Surfaces, APileOfWhitePlatesIsAsOne) {
  Medium medium = balls({Vec3d(0), Vec3d(2.5, 1.5, 0.5)}, 6);
  medium.optics.sigma_s = Vec3d(3);
  medium.optics.sigma_a = Vec3d(0.5);
  const auto lit = [](Coord p) { return p[0] < 7; };
  setEmission(medium, [&](Coord p) { return lit(p) ? 1 : 0; });
  const Vec3d normal = Vec3d(2.5, 1.5, 0.5).unit(), u = Vec3d(0, 0, 1).cross(normal).unit(),
              v = normal.cross(u);
  const auto pile = [&](int plates) {
    Scene scene;
    for (int n = 0; n < plates; ++n) {
      const Vec3d corner = Vec3d(1.25, 0.75, 0.25) - u * 30 - v * 30 + normal * (1e-3 * n);
      scene.surfaces.push_back({"plate", quad(corner, u * 60, v * 60), Vec3d(1)});
    }
    return swept(medium, scene, 2);
  };
  const DiffuseResult one = pile(1), many = pile(30), open = swept(medium, {}, 2);
  const double alone = meanOf(medium, open.diffuse[0], lit), before = meanOf(medium, one.diffuse[0], lit);
  EXPECT_GT(before, 1.005 * alone);
  EXPECT_NEAR(meanOf(medium, many.diffuse[0], lit) / before, 1, 1e-4);
  const auto other = [&](Coord p) { return !lit(p); };
  EXPECT_LT(meanOf(medium, many.diffuse[0], other), 1e-4 * meanOf(medium, open.diffuse[0], other));
}

// A plate of any tilt through one ball: nothing passes where it stands between voxels. Where it cuts them,
// rays that run along it within a voxel without ever meeting it carry a little.
TEST(Surfaces, BlackPlateCutsABall) {
  Medium medium = balls({Vec3d(0)}, 8);
  medium.optics.sigma_s = Vec3d(3);
  medium.optics.sigma_a = Vec3d(0.1);
  for (const Vec3d& normal : {Vec3d(1, 0, 0), Vec3d(0, 0, 1), Vec3d(0.3, 1, -0.2).unit(), Vec3d(1).unit()}) {
    const Vec3d u = std::abs(normal[0]) > 0.9 ? Vec3d(0, 1, 0) : normal.cross(Vec3d(1, 0, 0)).unit(),
                v = normal.cross(u);
    const double offset = 0.01;
    const auto above = [&](Coord p) { return normal.dot(medium.transform().toWorld(p.asVec3d())) > offset; };
    setEmission(medium, [&](Coord p) { return above(p) ? 0 : 1; });
    Scene scene;
    scene.surfaces.push_back({"plate", quad(normal * offset - u * 30 - v * 30, u * 60, v * 60), Vec3d(0)});
    const DiffuseResult result = swept(medium, scene, 3);
    const double lit = meanOf(medium, result.diffuse[0], [&](Coord p) { return !above(p); });
    const bool along_axis = normal[0] == 1 || normal[2] == 1;
    EXPECT_LE(meanOf(medium, result.diffuse[0], above), along_axis ? 0 : 0.006 * lit) << normal;
  }
}

// Against paths: a glowing ball over bright ground beside a grey wall that cuts a second one.
TEST(Surfaces, AgreesWithTheReference) {
  Medium medium = balls({Vec3d(0), Vec3d(3, 0, 0)}, 6);
  medium.optics.sigma_s = Vec3d(2);
  medium.optics.sigma_a = Vec3d(0.2);
  setEmission(medium, [](Coord p) { return p[0] < 9 ? 1 : 0; });
  Scene scene;
  scene.surfaces.push_back(ground(-1.2, 0.8));
  scene.surfaces.push_back(
      {"wall", quad(Vec3d(3, -4, -1.2), Vec3d(0, 8, 0), Vec3d(0, 0, 6)), Vec3d(0.5, 0.5, 0.5)});
  const DiffuseResult result = swept(medium, scene, 4);
  ReferenceSettings settings;
  settings.samples = 1000000;
  const ReferenceResult truth = reference(medium, scene, settings);
  const auto compare = [&](const std::function<bool(Coord)>& where, double tolerance) {
    const double expected = meanOf(medium, truth.diffuse[0], where);
    EXPECT_NEAR(meanOf(medium, result.diffuse[0], where) / expected, 1, tolerance) << expected;
    return expected;
  };
  compare([](Coord p) { return p[0] < 9 && p[2] > 2; }, 0.01);
  compare([](Coord p) { return p[0] < 9 && p[2] < -3; }, 0.01);
  const double before = compare([](Coord p) { return p[0] >= 9 && p[0] < 18; }, 0.05);  // noise of 1.5 %
  // Cells at the foot of the wall lie on either side of it.
  EXPECT_LT(meanOf(medium, result.diffuse[0], [](Coord p) { return p[0] >= 18; }), 0.01 * before);
}

// What scatters nearly straight on still lights the ground below: what bright ground adds to the light.
TEST(Surfaces, ForwardLightReachesTheGround) {
  Medium medium = balls({Vec3d(0)}, 6);
  medium.optics.sigma_s = Vec3d(3);
  medium.optics.g = 0.85;
  Scene bright = sunScene(Vec3d(0.2, 0, -1)), black = bright;
  bright.surfaces.push_back(ground(-1.3, 0.9));
  black.surfaces.push_back(ground(-1.3, 0));
  ReferenceSettings settings;
  settings.samples = 300000;
  const auto mean = [&](const auto& result) { return meanOf(medium, result.diffuse[0], everywhere); };
  const double expected =
      mean(reference(medium, bright, settings)) - mean(reference(medium, black, settings));
  EXPECT_NEAR((mean(swept(medium, bright, 3)) - mean(swept(medium, black, 3))) / expected, 1, 0.1);
}

// Bright ground before a bright wall in the sun, each with a ball: one in the sun, one in the wall's shade,
// where no light comes that a surface has not reflected.
TEST(Surfaces, GroundAndSunlitWallLightEachOther) {
  Medium medium = balls({Vec3d(0), Vec3d(3.5, 0, 0)}, 6);
  medium.optics.sigma_s = Vec3d(0.5);
  Scene scene = sunScene(Vec3d(1, 0.1, -1));
  scene.surfaces.push_back(ground(-1.2, 0.8, 15));
  scene.surfaces.push_back({"wall", quad(Vec3d(2, -6, -1.2), Vec3d(0, 12, 0), Vec3d(0, 0, 8)), Vec3d(0.8)});
  DiffuseSettings many;
  many.source.gather_directions = 512;  // few show the lit ground behind the wall too often or too seldom
  const DiffuseResult result = illuminate(medium, scene, many, {});
  ReferenceSettings settings;
  settings.samples = 200000;
  const ReferenceResult truth = reference(medium, scene, settings);
  const auto ratio = [&](const Field<float>& found, const Field<float>& expected, bool behind) {
    const auto where = [&](Coord p) { return (p[0] > 12) == behind; };
    return meanOf(medium, found, where) / meanOf(medium, expected, where);
  };
  for (const bool behind : {false, true}) {
    EXPECT_NEAR(ratio(result.direct[0], truth.direct[0], behind), 1, 0.03) << behind;
    EXPECT_NEAR(ratio(result.diffuse[0], truth.diffuse[0], behind), 1, 0.03) << behind;
  }
}

TEST(Surfaces, SameBitsForAnyNumberOfThreads) {
  Medium medium = balls({Vec3d(0), Vec3d(1.5, 1.8, 0.4)}, 6);
  Scene scene = sunScene(Vec3d(0.3, 0.2, -1));
  scene.surfaces.push_back(ground(-1.1, 0.7));
  scene.surfaces.push_back({"plate", quad(Vec3d(0.2, -3, -3), Vec3d(1, 6, 0), Vec3d(0, 0, 6)), Vec3d(0.4)});
  const DiffuseResult two = swept(medium, scene, 2);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  const DiffuseResult one = swept(medium, scene, 2);
  forEachVoxel(medium.topology(),
               [&](Coord p, size_t i) { ASSERT_EQ(one.diffuse[0][i], two.diffuse[0][i]) << p; });
  EXPECT_EQ(one.energy.escaped, two.energy.escaped);
}

}  // namespace
}  // namespace vdb_diffuse
