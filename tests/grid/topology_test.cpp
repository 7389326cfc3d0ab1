#include "grid/topology.h"

#include <gtest/gtest.h>

#include "grid/field.h"
#include "grid/ray_march.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

Topology twoBlocksAndAFarOne() {
  std::vector<Coord> origins{{8, -8, 0}, {0, -8, 0}, {1 << 20, 0, 0}};
  std::vector<BlockMask> active(3);
  for (BlockMask& mask : active) mask.setOn();
  active[2].setOff();
  active[2].setOn(voxelOffset(1, 2, 3));
  return Topology(origins, active);
}

TEST(Topology, FindsBlocksAndNeighboursOnBothSidesOfTheOrigin) {
  const Topology topology = twoBlocksAndAFarOne();
  ASSERT_EQ(topology.blockCount(), 3u);
  EXPECT_EQ(topology.activeVoxelCount(), 2u * 512 + 1);
  const int32_t left = topology.find({0, -8, 0}), right = topology.find({8, -8, 0});
  EXPECT_EQ(topology.neighbours(left)[Topology::kPlusX], right);
  EXPECT_EQ(topology.neighbours(right)[Topology::kMinusX], left);
  EXPECT_EQ(topology.neighbours(left)[Topology::kMinusY], kNoBlock);
  EXPECT_EQ(topology.find({0, 0, 0}), kNoBlock);
  EXPECT_TRUE(topology.isActive({(1 << 20) + 1, 2, 3}));
  EXPECT_FALSE(topology.isActive({(1 << 20) + 1, 2, 4}));
}

TEST(Topology, OrderDoesNotDependOnTheOrderOfInput) {
  std::vector<Coord> origins;
  for (int x = -2; x < 2; ++x)
    for (int y = -2; y < 2; ++y)
      for (int z = -2; z < 2; ++z) origins.emplace_back(8 * x, 8 * y, 8 * z);
  BlockMask on;
  on.setOn();
  const Topology a(origins, std::vector<BlockMask>(origins.size(), on));
  std::reverse(origins.begin(), origins.end());
  const Topology b(origins, std::vector<BlockMask>(origins.size(), on));
  for (size_t i = 0; i < a.blockCount(); ++i) EXPECT_EQ(a.origin(i), b.origin(i));
}

// Three blocks in a corner, thinned out by a hash, asked voxel by voxel.
TEST(Topology, OuterFacesAreThoseBesideVoxelsThatAreNotActive) {
  const std::vector<Coord> origins{{0, 0, 0}, {-8, 0, 0}, {0, 8, 0}, {0, 0, 8}, {8, 0, 0}, {0, -8, 0}};
  std::vector<BlockMask> active(origins.size());
  for (size_t b = 0; b < origins.size(); ++b)
    for (int n = 0; n < kBlockVoxels; ++n)
      if (hashed(origins[b] + voxelLocal(n)) > 0.3) active[b].setOn(n);
  const Topology topology(origins, active);
  const Coord step[6] = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};
  size_t found = 0;
  for (size_t b = 0; b < topology.blockCount(); ++b) {
    const std::array<BlockMask, 6> outer = topology.outerFaces(b);
    for (int face = 0; face < 6; ++face)
      for (int n = 0; n < kBlockVoxels; ++n) {
        const Coord p = topology.origin(b) + voxelLocal(n);
        EXPECT_EQ(outer[face].isOn(n), topology.isActive(p) && !topology.isActive(p + step[face]));
        found += outer[face].isOn(n);
      }
  }
  EXPECT_GT(found, 1000u);
}

TEST(RayMarch, PathLengthsAddUpToTheChordOfTheBox) {
  const Topology topology = twoBlocksAndAFarOne();  // a box 16 x 8 x 8 from (-.5,-8.5,-.5), and one far away
  const Vec3d p(-20, -3.3, 2.1), d(1, 0.02, -0.01);
  double length = 0, last = -1e300;
  int voxels = 0;
  marchRay(topology, p, d, 0, 100, [&](size_t, int, double t0, double t1) {
    EXPECT_GE(t0, last);
    last = t1;
    length += t1 - t0;
    ++voxels;
    return true;
  });
  EXPECT_NEAR(length, 16, 1e-12);
  EXPECT_GE(voxels, 16);
}

TEST(RayMarch, EveryVoxelIsEnteredWhereTheRayIsInsideIt) {
  const Topology topology = twoBlocksAndAFarOne();
  const Vec3d p(3.1, -4.2, 3.3);
  for (int i = 0; i < 50; ++i) {
    const Vec3d d(std::cos(i * 1.7), std::sin(i * 0.9), std::cos(i * 0.37 + 1));
    marchRay(topology, p, d, 0, 1e9, [&](size_t block, int voxel, double t0, double t1) {
      const Vec3d middle = p + d * (0.5 * (t0 + t1));
      const Coord centre = topology.origin(block) + voxelLocal(voxel);
      for (int a = 0; a < 3; ++a) EXPECT_NEAR(middle[a], centre[a], 0.5 + 1e-9);
      return true;
    });
  }
}

}  // namespace
}  // namespace vdb_diffuse
