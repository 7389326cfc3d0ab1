#include "check/slice.h"

#include <gtest/gtest.h>

#include "check/difference_picture.h"

namespace vdb_diffuse {
namespace {

/// A slab of 8 x 8 x 2 voxels; the value at (x,y,z) is x + 10 y + 100 z.
GridValues slab() {
  BlockMask mask;
  for (int n = 0; n < kBlockVoxels; ++n)
    if (voxelLocal(n)[2] < 2) mask.setOn(n);
  GridValues grid;
  grid.topology = std::make_shared<Topology>(std::vector<Coord>{{0, 0, 0}}, std::vector<BlockMask>{mask});
  grid.channels.emplace_back(*grid.topology);
  for (auto voxel = mask.beginOn(); voxel; ++voxel) {
    const Coord p = voxelLocal(voxel.pos());
    grid.channels[0].block(0)[voxel.pos()] = static_cast<float>(p[0] + 10 * p[1] + 100 * p[2]);
  }
  return grid;
}

TEST(Slice, IsNormalToTheShortestAxisAndRunsFromTheUpperLeft) {
  const GridValues grid = slab();
  const SlicePlane plane = sliceThrough(Coord(3, 4, 1), *grid.topology, *grid.topology);
  EXPECT_EQ(plane.normal, 2);
  ASSERT_EQ(plane.width(), 8);
  ASSERT_EQ(plane.height(), 8);
  const std::vector<float> values = sliceValues(grid, 0, plane);
  ASSERT_EQ(values.size(), 64u);
  EXPECT_EQ(values[0], 170.f);   // x 0, y 7, z 1
  EXPECT_EQ(values[7], 177.f);   // x 7
  EXPECT_EQ(values[56], 100.f);  // the lowest row is y 0
}

TEST(Slice, WhereAGridHasNoVoxelItsBackgroundStands) {
  GridValues grid = slab();
  grid.background[0] = -5;
  SlicePlane plane;
  plane.lowest = plane.highest = Coord(0, 0, 5);
  EXPECT_EQ(sliceValues(grid, 0, plane), std::vector<float>{-5});
}

TEST(DifferencePicture, IsDrawnForEqualGridsAndForGridsWithoutVoxels) {
  const GridValues grid = slab();
  GridValues empty;
  empty.channels.emplace_back(*empty.topology);
  for (const GridValues* other : {&grid, static_cast<const GridValues*>(&empty)})
    EXPECT_EQ(differencePicture(grid, *other, Coord(1, 1, 1), {"a", "b", 1}).substr(1, 3), "PNG");
  EXPECT_EQ(differencePicture(empty, empty, Coord(0, 0, 0), {"a", "b", 1}).substr(1, 3), "PNG");
}

}  // namespace
}  // namespace vdb_diffuse
