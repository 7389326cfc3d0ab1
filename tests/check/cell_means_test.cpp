#include "check/cell_means.h"

#include <gtest/gtest.h>

namespace vdb_diffuse {
namespace {

/// Two voxels at (-1,0,0) and (0,0,0) and one at (1,0,0), values 1, 2, 4.
GridValues threeVoxels() {
  BlockMask left, right;
  left.setOn(voxelOffset(7, 0, 0));
  right.setOn(voxelOffset(0, 0, 0));
  right.setOn(voxelOffset(1, 0, 0));
  GridValues grid;
  grid.topology = std::make_shared<Topology>(std::vector<Coord>{{-8, 0, 0}, {0, 0, 0}},
                                             std::vector<BlockMask>{left, right});
  grid.transform = Transform::uniform(0.5, Vec3d(10, 0, 0));
  grid.channels.emplace_back(*grid.topology);
  const auto set = [&](const Coord& p, float value) {
    const int32_t b = grid.topology->find(blockOriginOf(p));
    grid.channels[0].block(b)[voxelOffset(p[0] & 7, p[1] & 7, p[2] & 7)] = value;
  };
  set({-1, 0, 0}, 1);
  set({0, 0, 0}, 2);
  set({1, 0, 0}, 4);
  return grid;
}

TEST(CellMeans, AverageActiveVoxelsAndFollowTheIndexOrigin) {
  const GridValues means = cellMeans(threeVoxels(), 2);
  ASSERT_EQ(means.topology->activeVoxelCount(), 2u);
  EXPECT_EQ(means.channels[0].at(*means.topology, Coord(-1, 0, 0)), 1.0f);
  EXPECT_EQ(means.channels[0].at(*means.topology, Coord(0, 0, 0)), 3.0f);
}

TEST(CellMeans, ACellLiesInTheMiddleOfItsVoxels) {
  const GridValues grid = threeVoxels(), means = cellMeans(grid, 4);
  const Vec3d middle = grid.transform.toWorld(Vec3d(1.5));
  EXPECT_LT((means.transform.toWorld(Vec3d(0)) - middle).length(), 1e-12);
  EXPECT_LT((means.transform.toWorld(Vec3d(1, 0, 0)) - middle - Vec3d(2, 0, 0)).length(), 1e-12);
}

TEST(CellMeans, CellsOfOneVoxelAreTheGridItself) {
  const GridValues grid = threeVoxels(), means = cellMeans(grid, 1);
  for (const Coord& p : {Coord(-1, 0, 0), Coord(0, 0, 0), Coord(1, 0, 0)})
    EXPECT_EQ(means.channels[0].at(*means.topology, p), grid.channels[0].at(*grid.topology, p));
  EXPECT_EQ(means.topology->activeVoxelCount(), 3u);
}

}  // namespace
}  // namespace vdb_diffuse
