#include "scene/occluder.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <cmath>
#include <limits>

namespace vdb_diffuse {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A square of half width w in the plane z = 0 about `middle`, front up.
Surface square(double w, const Vec3d& middle) {
  Surface surface;
  for (const Vec3d& p : {Vec3d(-w, -w, 0), Vec3d(w, -w, 0), Vec3d(w, w, 0), Vec3d(-w, w, 0)})
    surface.mesh.positions.push_back(p + middle);
  surface.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return surface;
}

/// A closed cube of side 2 about `middle`, fronts outside.
Surface cube(const Vec3d& middle) {
  Surface surface;
  for (int i = 0; i < 8; ++i)
    surface.mesh.positions.push_back(Vec3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1) + middle);
  const uint32_t faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& f : faces) {
    surface.mesh.triangles.push_back({f[0], f[1], f[2]});
    surface.mesh.triangles.push_back({f[0], f[2], f[3]});
  }
  return surface;
}

TEST(Occluder, QuadIsMetOnBothSidesWhereItIs) {
  const Occluder occluder({square(1, Vec3d(0))});
  for (double side : {1.0, -1.0}) {
    const auto hit = occluder.closest(Vec3d(0.3, 0.2, 2.5 * side), Vec3d(0, 0, -side), kInfinity);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->distance, 2.5, 1e-12);
    EXPECT_EQ(hit->front, side > 0);
    EXPECT_EQ(hit->surface, 0);
    EXPECT_EQ(hit->triangle, 0u);
  }
  EXPECT_FALSE(occluder.closest(Vec3d(1.01, 0, 1), Vec3d(0, 0, -1), kInfinity));
  EXPECT_FALSE(occluder.closest(Vec3d(0.3, 0.2, 2), Vec3d(0, 0, 1), kInfinity)) << "behind the origin";
  EXPECT_FALSE(occluder.hidden(Vec3d(0, 0, 1), Vec3d(1, 0, 0), kInfinity)) << "parallel";
}

TEST(Occluder, DistanceLimitSeparatesLitFromHidden) {
  const Occluder occluder({square(1, Vec3d(0)), square(1, Vec3d(0, 0, 10))});
  const Vec3d p(0.1, 0.4, 2), down(0, 0, -1);
  EXPECT_TRUE(occluder.hidden(p, down, 2.001));
  EXPECT_FALSE(occluder.hidden(p, down, 1.999));
  EXPECT_TRUE(occluder.closest(p, down, 2.001));
  EXPECT_FALSE(occluder.closest(p, down, 1.999));
}

TEST(Occluder, BarycentricsGiveThePointThatWasHit) {
  const Surface surface = cube(Vec3d(1, 2, 3));
  const Occluder occluder({square(1, Vec3d(0, 0, -50)), surface});
  const Vec3d p(-3, 1.3, 2.2), d = Vec3d(0.9, 0.2, 0.3).unit();
  const auto hit = occluder.closest(p, d, kInfinity);
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->surface, 1);
  const auto& t = surface.mesh.triangles[hit->triangle];
  const Vec3d q = surface.mesh.positions[t[0]] * (1 - hit->u - hit->v) +
                  surface.mesh.positions[t[1]] * hit->u + surface.mesh.positions[t[2]] * hit->v;
  const double scene = 60;  // metres from square to cube: what float coordinates are relative to
  EXPECT_LT((q - (p + d * hit->distance)).length(), scene * 4e-7);
}

TEST(Occluder, FarWorldOriginCostsNoPrecision) {
  const Vec3d offset(1e6, -2e6, 3e6);
  const Occluder occluder({cube(offset)});
  for (double x : {-0.75, 0.0, 0.123456789}) {
    const auto hit = occluder.closest(offset + Vec3d(x, 0.1, 3), Vec3d(0, 0, -1), kInfinity);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->distance, 2, 1e-8);
    EXPECT_TRUE(hit->front);
  }
  EXPECT_NEAR(occluder.lowest()[0], 1e6 - 1, 1e-6);
  EXPECT_NEAR(occluder.highest()[2], 3e6 + 1, 1e-6);
}

TEST(Occluder, FarRayOriginCostsNoPrecision) {
  const Occluder occluder({cube(Vec3d(0))});
  // Float spacing at 3e7 is 2, the side of the cube.
  const auto hit = occluder.closest(Vec3d(0.999, 0.5, 3e7), Vec3d(0, 0, -1), kInfinity);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance, 3e7 - 1, 1e-6);
  EXPECT_FALSE(occluder.hidden(Vec3d(1.001, 0.5, 3e7), Vec3d(0, 0, -1), kInfinity));
}

TEST(Occluder, NoLightLeaksThroughTheEdgesOfAClosedCube) {
  const Occluder occluder({cube(Vec3d(5, 5, 5))});
  std::atomic<int> leaks{0};
  tbb::parallel_for(0, 20000, [&](int i) {
    const double z = 1 - (2 * i + 1) / 20000.0, phi = i * 2.399963, r = std::sqrt(1 - z * z);
    if (!occluder.hidden(Vec3d(5, 5, 5), Vec3d(r * std::cos(phi), r * std::sin(phi), z), kInfinity)) ++leaks;
    const Vec3d to_edge(1, (i % 101) / 50.0 - 1, i & 1 ? 1 : -1);  // straight at an edge
    if (!occluder.hidden(Vec3d(5, 5, 5), to_edge.unit(), kInfinity)) ++leaks;
  });
  EXPECT_EQ(leaks, 0);
}

TEST(Occluder, ASceneWithoutTrianglesHidesNothing) {
  for (const auto& surfaces : {std::vector<Surface>{}, std::vector<Surface>{Surface(), Surface()}}) {
    const Occluder occluder(surfaces);
    EXPECT_TRUE(occluder.empty());
    EXPECT_FALSE(occluder.hidden(Vec3d(0), Vec3d(0, 0, 1), kInfinity));
    EXPECT_FALSE(occluder.closest(Vec3d(0), Vec3d(0, 0, 1), kInfinity));
  }
  const Occluder occluder({Surface(), square(1, Vec3d(0))});
  EXPECT_EQ(occluder.closest(Vec3d(0, 0, 1), Vec3d(0, 0, -1), kInfinity)->surface, 1);
}

TEST(Occluder, RefusesWhatEmbreeWouldDropInSilence) {
  for (double bad : {std::nan(""), kInfinity, -kInfinity, 1e19, 1e300}) {
    Surface surface = square(1, Vec3d(0));
    surface.mesh.positions[2][1] = bad;
    EXPECT_THROW(Occluder({surface}), std::invalid_argument) << bad;
  }
  Surface surface = square(1, Vec3d(0));
  surface.mesh.triangles[1][2] = 4;
  EXPECT_THROW(Occluder({surface}), std::invalid_argument);
}

TEST(Occluder, ComesNearABoxThatATriangleMayMeet) {
  const Occluder occluder({square(1, Vec3d(5e3, 0, 0)), square(1, Vec3d(5e3, 0, 10))});
  const auto near = [&](double z0, double z1) {
    return occluder.comesNear(Vec3d(5e3 - 0.1, -0.1, z0), Vec3d(5e3 + 0.1, 0.1, z1));
  };
  EXPECT_TRUE(near(-1, 1));
  EXPECT_TRUE(near(8, 12));
  EXPECT_TRUE(near(-5, 0)) << "touches";
  EXPECT_FALSE(near(1, 9)) << "between the two, in the box of both";
  EXPECT_FALSE(occluder.comesNear(Vec3d(0), Vec3d(1)));
  EXPECT_FALSE(Occluder(std::vector<Surface>()).comesNear(Vec3d(-1), Vec3d(1)));
}

}  // namespace
}  // namespace vdb_diffuse
