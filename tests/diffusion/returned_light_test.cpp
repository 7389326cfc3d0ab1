#include "diffusion/returned_light.h"

#include <gtest/gtest.h>

#include "volumes.h"

namespace vdb_diffuse {
namespace {

struct Returned {
  Field<float> factor;
  double mean = 0, smallest = 1;  // over the voxels at the surface
};

/// Also checks the range that is promised, and that the interior has none.
Returned returned(const Medium& medium, double extinction, const std::vector<Surface>& surfaces = {}) {
  const Occluder occluder(surfaces);
  const Walls walls;
  ChannelOptics optics;
  optics.sigma_t_beam = extinction;
  Returned r{returnedLight(FaceProbe(medium, occluder, surfaces, walls, offPlanes()), optics, 0)};
  double count = 0;
  forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
    EXPECT_TRUE(r.factor[i] > 0.01f && r.factor[i] <= 1) << p;  // beta is at most 0.98
    bool surface = false;
    for (int face = 0; face < 6; ++face) {
      Coord q = p;
      q[face / 2] += face % 2 ? 1 : -1;
      surface = surface || !medium.topology().isActive(q);
    }
    if (!surface) {
      EXPECT_EQ(r.factor[i], 1) << p;
      return;
    }
    r.mean += r.factor[i];
    count += 1;
    r.smallest = std::min<double>(r.smallest, r.factor[i]);
  });
  r.mean /= count;
  return r;
}

double one(Coord) {
  return 1;
}

// A convex body sees nothing of its own light but what its steps return, and those are in the area factor.
// How much that is was fitted to balls.
TEST(ReturnedLight, ConvexBodiesGetNoneBack) {
  const Medium ball = ballMedium(4, 0.25), box = boxMedium(Coord(24, 24, 24), Transform::uniform(0.25), one);
  for (double extinction : {0.3, 1.0, 4.0, 8.8}) {  // 0.07 to 2.2 optical depths a voxel
    EXPECT_GT(returned(ball, extinction).mean, 0.9) << extinction;
    EXPECT_GT(returned(box, extinction).smallest, 0.97) << extinction;
  }
}

// Of two wide opaque plates each has one side that gets all its light back and one that gets none: beta =
// 1/2, x = (1 - beta) / (1 + beta) = 1/3.
TEST(ReturnedLight, FacingPlatesGetHalfBack) {
  constexpr int kWidth = 80;
  const Medium plates = boxMedium(
      Coord(kWidth, kWidth, 4), Transform(), [](Coord p) { return p[2] >= 1 && p[2] < 3 ? -1 : 1; },
      Coord(0, 0, -2));
  const Returned r = returned(plates, 100);
  double sum = 0, count = 0;
  forEachVoxel(plates.topology(), [&](Coord p, size_t i) {
    if (p[0] < 16 || p[1] < 16 || p[0] >= kWidth - 16 || p[1] >= kWidth - 16) return;
    EXPECT_NEAR(r.factor[i], 1.0 / 3, 0.2 / 3) << p;
    sum += r.factor[i];
    count += 1;
  });
  EXPECT_NEAR(sum / count, 1.0 / 3, 0.05 / 3);
}

// Close above a wide ground of albedo R an opaque plate gets R of its light back: x = (1 - R) / (1 + R).
TEST(ReturnedLight, GroundGivesItsAlbedoBack) {
  constexpr int kWidth = 64, kHeight = 12;  // the upper side is out of the lower one's reach
  const Medium plate = boxMedium(Coord(kWidth, kWidth, kHeight), Transform(), one);
  for (double albedo : {0.0, 0.3, 0.5, 0.8}) {
    const std::vector<Surface> ground{
        {"ground", quad(Vec3d(-200, -200, -1.5), Vec3d(464, 0, 0), Vec3d(0, 464, 0)), Vec3d(albedo)}};
    const Returned r = returned(plate, 100, ground);
    const double x = (1 - albedo) / (1 + albedo);
    for (int i = 20; i < kWidth - 20; i += 3) {
      EXPECT_NEAR(r.factor.at(plate.topology(), Coord(i, kWidth - i, 0)), x, 0.03) << albedo;
      EXPECT_GT(r.factor.at(plate.topology(), Coord(i, i, kHeight - 1)), 0.97) << albedo;
    }
  }
}

TEST(ReturnedLight, NothingLeavesAClosedCavity) {
  for (int height : {48, 49}) {  // the middle between voxels and in one
    const Medium cavity = boxMedium(Coord(48, 48, height), Transform(), [](Coord p) {
      const auto in = [](int x) { return x >= 16 && x < 32; };
      return in(p[0]) && in(p[1]) && in(p[2]) ? -1 : 1;
    });
    const Returned r = returned(cavity, 50);
    const Topology& topology = cavity.topology();
    for (const Coord& p : {Coord(15, 20, 22), Coord(32, 24, 17), Coord(17, 15, 24), Coord(24, 16, 32)})
      EXPECT_LT(r.factor.at(topology, p), 0.03) << p;  // 0.02 / 1.98 over what the corners return anyway
    EXPECT_GT(r.factor.at(topology, Coord(0, 20, 20)), 0.97);  // the outer side
  }
}

/// Rows of voxels are where the light is summed, and where it is not: a sponge in slabs of active vacuum must
/// not care which way they lie.
TEST(ReturnedLight, ActiveVacuumCountsWhicheverWayItLies) {
  const auto density = [](int x, int y, int z) {
    if (x % 12 < 4) return lumpyDensity(Coord(x, y, z)) > 0 ? 0.0 : -1.0;
    return lumpyDensity(Coord(x, y, z));
  };
  const Medium plain =
      boxMedium(Coord(32, 24, 16), Transform(), [&](Coord p) { return density(p[0], p[1], p[2]); });
  const Medium turned =
      boxMedium(Coord(24, 16, 32), Transform(), [&](Coord p) { return density(p[2], p[0], p[1]); });
  EXPECT_LT(largestDifference(plain.topology(), returned(plain, 2).factor, turned.topology(),
                              returned(turned, 2).factor, [](Coord p) { return Coord(p[1], p[2], p[0]); }),
            1e-4);
}

TEST(ReturnedLight, SpongeGetsMuchBack) {
  const Medium sponge = boxMedium(Coord(32, 32, 32), Transform(), [](Coord p) { return lumpyDensity(p); });
  const double thick = returned(sponge, 4).mean, thin = returned(sponge, 0.02).mean;
  EXPECT_LT(thick, 0.5);
  EXPECT_GT(thin, thick);  // a thin one is seen through
}

TEST(ReturnedLight, HasNoUnitAndNoPlace) {
  const auto sponge = [](double h, double density, const Coord& offset = Coord(0, 0, 0)) {
    return boxMedium(
        Coord(32, 24, 16), Transform::uniform(h), [=](Coord p) { return density * lumpyDensity(p); }, offset);
  };
  const Medium plain = sponge(0.5, 1), large = sponge(0.5 * 1024, 1), thin = sponge(0.5, 0x1p-30);
  const Returned r = returned(plain, 2);
  EXPECT_EQ(largestDifference(plain.topology(), returned(large, 2.0 / 1024).factor, r.factor), 0);
  EXPECT_EQ(largestDifference(plain.topology(), returned(thin, 2 * 0x1p30).factor, r.factor), 0);
  for (const Coord& offset : {Coord(-64, 800, 8), Coord(3, -5, 7)}) {
    const Medium moved = sponge(0.5, 1, offset);
    EXPECT_LT(largestDifference(plain.topology(), r.factor, moved.topology(), returned(moved, 2).factor,
                                [&](Coord p) { return p + offset; }),
              1e-5);
  }
}

}  // namespace
}  // namespace vdb_diffuse
