#include "shapes/solids.h"

#include <gtest/gtest.h>

#include "grid/error.h"
#include "shapes/volume_checks.h"

namespace vdb_diffuse {
namespace {

constexpr double kPi = 3.14159265358979323846;

TEST(Solids, HoldAboutAsManyVoxelsAsAsked) {
  // A ball grows by up to 48 lattice points at once, the images of one: half of that is as near as it comes.
  for (size_t n : {500, 650, 20000, 300000}) {
    const ShapeSize size{n};
    for (const Volume& volume : {makeSphere(size), makeShell(size), makeBox(size), makeLayers(size),
                                 makeCheckerboard(size), makeSheet(size)}) {
      expectSound(volume);
      EXPECT_NEAR(double(volume.topology->activeVoxelCount()), double(n), 24 + 0.02 * double(n));
    }
  }
}

TEST(Solids, BallHasTheVolumeAndMassOfABall) {
  // A ball of radius R voxels holds as many lattice points as its volume, but for some multiple of R.
  const double radius = 0.5 * kShapeWidth, ball = 4.0 / 3 * kPi * radius * radius * radius;
  double last_radius = 0;
  for (size_t n : {4000, 100000, 1000000}) {
    const Volume volume = makeSphere({n}, 2.5);
    const double h = volume.transform.meanVoxelSize(), voxels = radius / h;
    EXPECT_GT(voxels, last_radius);
    last_radius = voxels;
    EXPECT_NEAR(massOf(volume), 2.5 * ball, 2.5 * ball * 3 / (voxels * voxels));
  }
}

TEST(Solids, ShellHasAnActiveCavityOfZeroDensity) {
  const Volume volume = makeShell({200000}, 3);
  const Topology& topology = *volume.topology;
  EXPECT_TRUE(topology.isActive({0, 0, 0}));
  EXPECT_EQ(volume.values.at(topology, {0, 0, 0}), 0);
  size_t hollow = 0;
  forEachActive(volume, [&](const Coord& p, float value) {
    const double r = volume.transform.toWorld(p.asVec3d()).length() / (0.5 * kShapeWidth);
    EXPECT_LT(r, 1);
    EXPECT_EQ(value, r < 0.5 ? 0.0f : 3.0f);
    hollow += value == 0;
  });
  EXPECT_NEAR(double(hollow) / double(topology.activeVoxelCount()), 1.0 / 8, 0.002);
}

TEST(Solids, BoxIsCentredAndAlmostACube) {
  const Volume volume = makeBox({30000});
  Vec3d low(1e9), high(-1e9);
  forEachActive(volume, [&](const Coord& p, float value) {
    EXPECT_EQ(value, 1.0f);
    low = openvdb::math::minComponent(low, volume.transform.toWorld(p.asVec3d() - Vec3d(0.5)));
    high = openvdb::math::maxComponent(high, volume.transform.toWorld(p.asVec3d() + Vec3d(0.5)));
  });
  const double h = volume.transform.meanVoxelSize();
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(low[a], -high[a], 1e-9);
    EXPECT_NEAR(high[a] - low[a], kShapeWidth, 1.5 * h);
  }
  EXPECT_NEAR(massOf(volume), kShapeWidth * kShapeWidth * kShapeWidth, 1e-6);
}

TEST(Solids, LayersAlternateUpwardAndAreActiveThroughout) {
  const Volume volume = makeLayers({8000}, 4, 3);
  forEachActive(volume,
                [](const Coord& p, float value) { EXPECT_EQ(value, p[2] / 3 % 2 == 0 ? 4.0f : 0.0f) << p; });
  EXPECT_EQ(volume.topology->activeVoxelCount(), makeBox({8000}).topology->activeVoxelCount());
  // By default there are as many slabs at every resolution.
  for (size_t n : {8 * 8 * 8, 32 * 32 * 32}) {
    const Volume usual = makeLayers({n});
    const int side = static_cast<int>(std::lround(std::cbrt(double(n))));
    int changes = 0;
    for (int z = 1; z < side; ++z)
      changes +=
          usual.values.at(*usual.topology, {1, 1, z}) != usual.values.at(*usual.topology, {1, 1, z - 1});
    EXPECT_EQ(changes, 7);
  }
}

TEST(Solids, EveryNeighbourOnTheCheckerboardDiffersByTheContrast) {
  const Volume volume = makeCheckerboard({5000}, 0.5, 1e6);
  forEachActive(volume, [&](const Coord& p, float value) {
    for (int a = 0; a < 3; ++a) {
      Coord next = p;
      ++next[a];
      if (!volume.topology->isActive(next)) continue;
      const float other = volume.values.at(*volume.topology, next);
      EXPECT_EQ(std::min(value, other), 0.5f);
      EXPECT_EQ(std::max(value, other), 5e5f);
    }
  });
  const Volume coarse = makeCheckerboard({5000}, 1, 10, 4);
  EXPECT_EQ(coarse.values.at(*coarse.topology, {3, 3, 3}), 1);
  EXPECT_EQ(coarse.values.at(*coarse.topology, {4, 3, 3}), 10);
}

TEST(Solids, SheetIsOneVoxelThickAndAsDeepOpticallyAsAskedAtEverySize) {
  for (double voxel_size : {0.0, 0.003}) {
    const Volume volume = makeSheet({10000, voxel_size}, 2);
    const double h = volume.transform.meanVoxelSize();
    forEachActive(volume, [&](const Coord& p, float value) {
      EXPECT_EQ(p[2], 0);
      EXPECT_NEAR(value * h, 2, 1e-6);
    });
  }
}

TEST(Solids, VoxelSizeScalesTheWorldAndNothingElse) {
  const Volume natural = makeSphere({5000}), scaled = makeSphere({5000, 0.25});
  EXPECT_DOUBLE_EQ(scaled.transform.meanVoxelSize(), 0.25);
  expectSame(natural, scaled);
}

TEST(Solids, WhatCannotBeMadeIsRefused) {
  EXPECT_THROW(makeBox({0}), UsageError);
  EXPECT_THROW(makeBox({1000, -1}), UsageError);
  EXPECT_THROW(makeBox({1000, NAN}), UsageError);
  EXPECT_THROW(makeSheet({size_t(1) << 50}), InputError);
}

}  // namespace
}  // namespace vdb_diffuse
