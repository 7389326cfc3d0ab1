#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "diffusion/diffuse.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

// The same cloud under the same light, told in other coordinates, other units or to another number of
// threads.

constexpr double kStep = 0.3;
constexpr double kTolerance = 1e-7;  // of the solves: what is left after them is 1e-5 at the most
const Coord kSize(20, 17, 19);

struct Setting {
  Coord offset{0, 0, 0};  // of the voxels in the grid
  Transform transform = Transform::uniform(kStep);
  std::array<int, 3> axis{0, 1, 2};                   // which of the cloud's axes each of the grid's is,
  std::array<bool, 3> mirrored{false, false, false};  // and whether it runs backward
  double density = 1, sigma = 1;                      // factors
};

/// Where the cloud's voxel p lies in a grid.
Coord place(const Setting& s, const Coord& p) {
  Coord q;
  for (int a = 0; a < 3; ++a)
    q[a] = s.offset[a] + (s.mirrored[a] ? kSize[s.axis[a]] - 1 - p[s.axis[a]] : p[s.axis[a]]);
  return q;
}
Vec3d turn(const Setting& s, const Vec3d& v) {
  Vec3d w;
  for (int a = 0; a < 3; ++a) w[a] = s.mirrored[a] ? -v[s.axis[a]] : v[s.axis[a]];
  return w;
}

Medium cloudIn(const Setting& s, double g, bool emits) {
  Coord size;
  for (int a = 0; a < 3; ++a) size[a] = kSize[s.axis[a]];
  const auto original = [s](Coord q) {  // q without the offset
    Coord p;
    for (int a = 0; a < 3; ++a) p[s.axis[a]] = s.mirrored[a] ? kSize[s.axis[a]] - 1 - q[a] : q[a];
    return p;
  };
  Medium medium = boxMedium(
      size, s.transform, [&](Coord q) { return s.density * lumpyDensity(original(q)); }, s.offset);
  medium.optics.sigma_s = Vec3d(1.5 * s.sigma);
  medium.optics.sigma_a = Vec3d(0.1 * s.sigma);
  medium.optics.g = g;
  if (emits) setEmission(medium, [&](Coord q) { return hashed(original(q - s.offset), 3); });
  return medium;
}

struct Solved {
  Medium medium;
  DiffuseResult result;
};

Solved solved(const Setting& s, const Scene& scene, double g = 0.6, bool emits = false,
              double tolerance = kTolerance) {
  Solved r{cloudIn(s, g, emits), {}};
  DiffuseSettings settings;
  settings.tolerance = tolerance;
  r.result = diffuse(r.medium, scene, settings);
  EXPECT_TRUE(r.result.converged);
  return r;
}

void expectSame(const Solved& a, const Setting& b_setting, const Solved& b, double tolerance,
                const std::string& what) {
  const auto map = [&](Coord p) { return place(b_setting, p); };
  EXPECT_LE(largestDifference(a.medium.topology(), a.result.direct[0], b.medium.topology(),
                              b.result.direct[0], map),
            std::min(tolerance, 2e-6))
      << what;
  EXPECT_LE(largestDifference(a.medium.topology(), a.result.diffuse[0], b.medium.topology(),
                              b.result.diffuse[0], map),
            tolerance)
      << what;
}

void expectSameBits(const Solved& a, const Solved& b, double energy_factor, const std::string& what) {
  expectSame(a, {}, b, 0, what);
  EXPECT_EQ(a.result.energy.absorbed * energy_factor, b.result.energy.absorbed) << what;
  EXPECT_EQ(a.result.energy.escaped * energy_factor, b.result.energy.escaped) << what;
  EXPECT_EQ(a.result.iterations, b.result.iterations) << what;
}

Scene lampScene(const Vec3d& position) {
  Scene scene;
  scene.lights.push_back({"lamp", PointLight{position, Vec3d(30), 0}});
  return scene;
}

TEST(Invariance, MovingTheVoxelsInTheGrid) {
  Setting moved;
  const Vec3d d(0.2, -0.4, -1), lamp(2, 8, 3);
  for (const Coord& offset : {Coord(3, -5, 7), Coord(8, 8, 8), Coord(1 << 29, -(1 << 29), 5)}) {
    moved.offset = offset;
    expectSame(solved({}, sunScene(d)), moved, solved(moved, sunScene(d)), 1e-5, "sun");
  }
  moved.offset = Coord(3, -5, 7);
  const Vec3d shift = moved.offset.asVec3d() * kStep;
  expectSame(solved({}, lampScene(lamp), 0, true), moved, solved(moved, lampScene(lamp + shift), 0, true),
             1e-5, "lamp and emission");
}

TEST(Invariance, MovingTheWorldsOrigin) {
  Setting moved;
  const Vec3d shift = Vec3d(1e6, -1e6, 1e6) * kStep, lamp(2, 8, 3);
  moved.transform = Transform::uniform(kStep, shift);
  expectSame(solved({}, sunScene(Vec3d(0.2, -0.4, -1))), moved, solved(moved, sunScene(Vec3d(0.2, -0.4, -1))),
             1e-5, "sun");
  expectSame(solved({}, lampScene(lamp)), moved, solved(moved, lampScene(lamp + shift)), 1e-5, "lamp");
}

std::vector<Setting> turnsAndMirrors() {
  std::vector<Setting> all;
  for (const std::array<int, 3>& axis : {std::array<int, 3>{0, 1, 2}, {1, 0, 2}, {2, 1, 0}, {1, 2, 0}})
    for (int mirrors = 0; mirrors < 8; mirrors += 3) {  // none, two, two others
      Setting s;
      s.axis = axis;
      for (int a = 0; a < 3; ++a) s.mirrored[a] = mirrors >> a & 1;
      all.push_back(s);
    }
  all[1].mirrored = {true, false, false};
  return all;
}

// Emission, a beam along an axis and a lamp favour no axis of the grid; an oblique beam does (below).
TEST(Invariance, QuarterTurnsAndMirrors) {
  const Vec3d d(0, -1, 0), lamp(1.7, 9, 2.2);
  const Solved sun = solved({}, sunScene(d)), lit = solved({}, lampScene(lamp), -0.3, true);
  for (const Setting& turned : turnsAndMirrors()) {
    ::testing::Message how;
    how << "axes " << turned.axis[0] << turned.axis[1] << turned.axis[2] << " mirrored " << turned.mirrored[0]
        << turned.mirrored[1] << turned.mirrored[2];
    expectSame(sun, turned, solved(turned, sunScene(turn(turned, d))), 1e-5, "sun, " + how.GetString());
    Vec3d position = turn(turned, lamp);
    for (int a = 0; a < 3; ++a)  // a mirrored axis runs down from the last voxel
      if (turned.mirrored[a]) position[a] += (kSize[turned.axis[a]] - 1) * kStep;
    expectSame(lit, turned, solved(turned, lampScene(position), -0.3, true), 1e-5,
               "lamp and emission, " + how.GetString());
  }
}

TEST(Invariance, ObliqueBeamTurnsUpToItsRays) {
  const Vec3d d(0.3, -0.5, -1);
  const auto direct = [](const Medium& medium, const Vec3d& direction, int rays) {
    FirstScatterSettings settings;
    settings.rays_per_voxel = rays;
    return firstScatter(medium, sunScene(direction), Occluder({}), Model::kP1, settings).direct[0];
  };
  // The worst voxel of all, as a fraction of the brightest: a voxel half in the shadow of another's corner.
  for (const auto& [rays, tolerance] : {std::pair(4, 0.25), std::pair(32, 0.05)})
    for (const Setting& turned : turnsAndMirrors()) {
      const Medium a = cloudIn({}, 0, false), b = cloudIn(turned, 0, false);
      EXPECT_LT(
          largestDifference(a.topology(), direct(a, d, rays), b.topology(), direct(b, turn(turned, d), rays),
                            [&](Coord p) { return place(turned, p); }),
          tolerance)
          << rays << " rays";
    }
}

TEST(Invariance, TurningTheWorld) {
  const double c = std::cos(M_PI / 4), s = std::sin(M_PI / 4);
  const auto turned = [&](const Vec3d& v) { return Vec3d(c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]); };
  Setting rotated;
  rotated.transform =
      Transform(turned(Vec3d(kStep, 0, 0)), turned(Vec3d(0, kStep, 0)), Vec3d(0, 0, kStep), Vec3d(1, 2, 3));
  for (const Vec3d& d : {Vec3d(1, 0, 0), Vec3d(0.2, -0.4, -1)})
    expectSame(solved({}, sunScene(d)), rotated, solved(rotated, sunScene(turned(d))), 1e-5, "sun");
  const Vec3d lamp(2, 8, 3);
  expectSame(solved({}, lampScene(lamp)), rotated, solved(rotated, lampScene(turned(lamp) + Vec3d(1, 2, 3))),
             1e-5, "lamp");
  // The flux is told in world axes.
  DiffuseSettings settings;
  settings.want_flux = true;
  settings.tolerance = kTolerance;
  const Medium upright_medium = cloudIn({}, 0.6, false), turned_medium = cloudIn(rotated, 0.6, false);
  const Vec3d d(0.2, -0.4, -1);
  const DiffuseResult a = diffuse(upright_medium, sunScene(d), settings),
                      b = diffuse(turned_medium, sunScene(turned(d)), settings);
  double worst = 0, largest = 0;
  forEachVoxel(upright_medium.topology(), [&](Coord, size_t i) {
    const Vec3d u = turned(Vec3d(a.flux[0][i], a.flux[1][i], a.flux[2][i])),
                v(b.flux[0][i], b.flux[1][i], b.flux[2][i]);
    worst = std::max(worst, (u - v).length());
    largest = std::max(largest, v.length());
  });
  EXPECT_LT(worst, 1e-5 * largest);
}

TEST(Invariance, UnitOfLength) {
  const Vec3d d(0.2, -0.4, -1);
  const Solved one = solved({}, sunScene(d), 0.6, true);
  for (double k : {0x1p-20, 0.5, 0x1p20, 3.7, 1e-3, 1e9}) {
    Setting scaled;
    scaled.transform = Transform::uniform(kStep * k);
    scaled.sigma = 1 / k;
    const Solved other = solved(scaled, sunScene(d), 0.6, true);
    int exponent;
    const std::string what = "lengths times " + std::to_string(k);
    if (std::frexp(k, &exponent) == 0.5)
      expectSameBits(one, other, k * k, what);
    else
      expectSame(one, scaled, other, 1e-5, what);
  }
}

TEST(Invariance, UnitOfDensity) {
  const Vec3d d(0.2, -0.4, -1);
  const Solved one = solved({}, sunScene(d), 0.6, true);
  for (double k : {0x1p-20, 0x1p20, 3.7, 1e9}) {
    Setting scaled;
    scaled.density = k;
    scaled.sigma = 1 / k;
    const Solved other = solved(scaled, sunScene(d), 0.6, true);
    int exponent;
    const std::string what = "densities times " + std::to_string(k);
    if (std::frexp(k, &exponent) == 0.5)
      expectSameBits(one, other, 1, what);
    else
      expectSame(one, scaled, other, 1e-5, what);
  }
}

TEST(Invariance, NumberOfThreadsAndRepetition) {
  Scene scene = sunScene(Vec3d(0.2, -0.4, -1), Vec3d(1, 0.5, 0.2));
  scene.surfaces.push_back({"ground", quad(Vec3d(-5, -5, -1), Vec3d(20, 0, 0), Vec3d(0, 20, 0)), Vec3d(0.5)});
  const auto threads = [&](size_t count) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                      std::max<size_t>(count, 2));
    tbb::task_arena arena(static_cast<int>(count));
    Solved s;
    arena.execute([&] { s = solved({}, scene, 0.6, true, 1e-4); });
    return s;
  };
  const Solved one = threads(1);
  expectSameBits(one, threads(1), 1, "again");
  expectSameBits(one, threads(2), 1, "two threads");
  expectSameBits(one, threads(7), 1, "seven threads");
  for (size_t c = 0; c < 3; ++c) {
    const Solved two = threads(2);
    ASSERT_EQ(two.result.diffuse.size(), 3u);
    EXPECT_EQ(largestDifference(one.medium.topology(), one.result.diffuse[c], two.result.diffuse[c]), 0);
  }
}

}  // namespace
}  // namespace vdb_diffuse
