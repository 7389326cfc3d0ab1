#include "scene/repeated_triangles.h"

#include <gtest/gtest.h>

namespace vdb_diffuse {
namespace {

using Triangles = std::vector<std::array<uint32_t, 3>>;

TEST(RepeatedTriangles, LeavesTheFirstOfThoseThatLieInThePlaceOfEachOther) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}, {-0.0, 0, 0}};
  mesh.triangles = {{0, 1, 3}, {0, 1, 2}, {1, 2, 0}, {2, 5, 4}, {0, 1, 3}, {1, 2, 3}};
  dropRepeatedTriangles(mesh);
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 3}, {0, 1, 2}, {1, 2, 3}}));
  EXPECT_EQ(mesh.positions.size(), 6u);
}

TEST(RepeatedTriangles, KeepsTheOtherSideAndTrianglesThatOnlyTouch) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 1, 1e-12}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 1}, {1, 3, 2}, {0, 1, 4}, {0, 0, 0}};
  const Triangles all = mesh.triangles;
  dropRepeatedTriangles(mesh);
  EXPECT_EQ(mesh.triangles, all);
}

}  // namespace
}  // namespace vdb_diffuse
