#include "multigrid/pieces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace vdb_diffuse {
namespace {

/// Voxels of one block that conduct alike.
Operator networkOf(const std::vector<Coord>& voxels) {
  BlockMask mask;
  for (const Coord& p : voxels) mask.setOn(voxelOffset(p[0], p[1], p[2]));
  Operator A;
  A.topology = std::make_shared<const Topology>(std::vector<Coord>{{0, 0, 0}}, std::vector<BlockMask>{mask});
  A.half_resistance = Field<float>(*A.topology, std::numeric_limits<float>::infinity());
  for (const Coord& p : voxels) A.half_resistance[voxelOffset(p[0], p[1], p[2])] = 0.5f;
  A.sink = Field<float>(*A.topology);
  return A;
}

TEST(Pieces, VoxelsThatMeetAtAnEdgeAreApart) {
  for (int axis = 0; axis < 3; ++axis)
    for (const int turn : {-1, 1}) {
      Coord along(0), aside(0);
      along[axis] = 1;
      aside[(axis + 1) % 3] = 1;
      aside[(axis + 2) % 3] = turn;
      Coord p(2);
      if (turn < 0) p[(axis + 2) % 3] = 3;
      const Coord q = p + aside;  // in the same coarse voxels
      const Parts parts = separatePieces(networkOf({p, p + along, q, q + along}));
      EXPECT_EQ(parts.layers, 2) << axis << ' ' << turn;
      EXPECT_EQ(parts.parts.size(), 2u);
    }
}

TEST(Pieces, AWindingPathIsOnePiece) {
  std::vector<Coord> path;
  for (int x = 0; x < 8; x += 2)
    for (int y = 0; y < 8; y += 2) {  // a serpentine through every other row of every other slice
      for (int z = 0; z < 8; ++z) path.emplace_back(x, y, z);
      if (y < 6) path.emplace_back(x, y + 1, (y / 2 + x / 2) % 2 ? 0 : 7);
      if (x < 6 && y == 0) path.emplace_back(x + 1, x / 2 % 2 ? 0 : 6, 7);
    }
  EXPECT_EQ(separatePieces(networkOf(path)).parts.size(), 1u);
  path.erase(
      std::find(path.begin(), path.end(), Coord(3, 0, 7)));  // the way from the lower to the upper half
  const Parts cut = separatePieces(networkOf(path));
  EXPECT_EQ(cut.layers, 2);
}

}  // namespace
}  // namespace vdb_diffuse
