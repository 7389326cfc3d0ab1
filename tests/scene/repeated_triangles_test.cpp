#include "scene/repeated_triangles.h"

#include <gtest/gtest.h>

namespace vdb_diffuse {
namespace {

using Triangles = std::vector<std::array<uint32_t, 3>>;

Mesh meshOf(const std::vector<Vec3d>& positions, const Triangles& triangles) {
  Mesh mesh;
  mesh.positions = positions;
  mesh.triangles = triangles;
  return mesh;
}
Triangles leftOf(const Mesh& mesh) {
  Scene scene;
  scene.surfaces.push_back({"", mesh, Vec3d(0)});
  dropRepeatedTriangles(scene);
  return scene.surfaces.at(0).mesh.triangles;
}

const std::vector<Vec3d> kCorners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}, {-0.0, 0, 0}};

TEST(RepeatedTriangles, LeavesTheFirstOfThoseThatLieInThePlaceOfEachOther) {
  const Triangles all{{0, 1, 3}, {0, 1, 2}, {1, 2, 0}, {2, 5, 4}, {0, 1, 3}, {1, 2, 3}};
  EXPECT_EQ(leftOf(meshOf(kCorners, all)), (Triangles{{0, 1, 3}, {0, 1, 2}, {1, 2, 3}}));
}

TEST(RepeatedTriangles, KeepsTheOtherSideAndTrianglesThatOnlyTouch) {
  const Triangles all{{0, 1, 2}, {0, 2, 1}, {1, 3, 2}, {0, 1, 4}, {0, 0, 0}};
  EXPECT_EQ(leftOf(meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 1, 1e-12}}, all)), all);
}

// Instances of one mesh in one place are surfaces of their own.
TEST(RepeatedTriangles, SurfacesRepeatEachOtherAndLightsOnlyThemselves) {
  Scene scene;
  scene.surfaces.push_back({"first", meshOf(kCorners, {{0, 1, 2}}), Vec3d(0.5)});
  scene.surfaces.push_back({"again", meshOf(kCorners, {{1, 2, 0}}), Vec3d(0.2)});
  scene.surfaces.push_back({"more", meshOf(kCorners, {{0, 1, 2}, {0, 1, 3}}), Vec3d(0.1)});
  const AreaLight light{meshOf(kCorners, {{0, 1, 2}, {0, 1, 3}, {0, 1, 3}}), Vec3d(1)};
  scene.lights = {{"one", light}, {"two", light}};
  dropRepeatedTriangles(scene);
  ASSERT_EQ(scene.surfaces.size(), 2u);
  EXPECT_EQ(scene.surfaces[0].name, "first");
  EXPECT_EQ(scene.surfaces[0].mesh.triangles, (Triangles{{0, 1, 2}}));
  EXPECT_EQ(scene.surfaces[1].name, "more");
  EXPECT_EQ(scene.surfaces[1].mesh.triangles, (Triangles{{0, 1, 3}}));
  for (const NamedLight& named : scene.lights)
    EXPECT_EQ(std::get<AreaLight>(named.light).mesh.triangles, (Triangles{{0, 1, 2}, {0, 1, 3}}));
}

}  // namespace
}  // namespace vdb_diffuse
