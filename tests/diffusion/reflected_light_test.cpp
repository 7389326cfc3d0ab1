#include "diffusion/reflected_light.h"

#include <gtest/gtest.h>

#include "diffusion/first_scatter.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

// A wall across bright ground and through the volume, the sun on one side: on the other the shadow covers all
// the ground there is. However cells lie about the wall's foot, no light comes through but for rounding.
TEST(ReflectedLight, NoneLeaksUnderAWall) {
  Medium medium = boxMedium(
      Coord(16, 16, 8), Transform::uniform(0.1), [](Coord) { return 1.0; }, Coord(-8, 0, 0));
  medium.optics.sigma_s = Vec3d(0.01);
  for (const double foot : {-0.05, -0.02, 0.04, 0.11}) {
    Scene scene = sunScene(Vec3d(1, 0, -1));
    scene.surfaces.push_back(
        {"ground", quad(Vec3d(-9, -9, -0.2), Vec3d(14, 0, 0), Vec3d(0, 18, 0)), Vec3d(0.9)});
    scene.surfaces.push_back(
        {"wall", quad(Vec3d(foot, -9, -1), Vec3d(0, 18, 0), Vec3d(0, 0, 9)), Vec3d(0.9)});
    const FirstScatter light = firstScatter(medium, scene, Occluder(scene.surfaces), Model::kDefault);
    double sunny = 0, shady = 0;  // the brightest voxel on either side
    forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
      const double from_wall = 0.1 * p[0] - foot;
      if (std::abs(from_wall) < 0.1) return;
      double& most = from_wall < 0 ? sunny : shady;
      most = std::max<double>(most, light.direct[0][i]);
    });
    EXPECT_LT(shady, 1e-6 * sunny) << foot;
  }
}

// Light that a small bright facet throws back: its cell reaches far beyond it, where plates hide the sun.
TEST(ReflectedLight, FacetsSmallerThanTheirCellsAreLitWhereTheyAre) {
  Medium medium = boxMedium(Coord(8, 8, 8), Transform::uniform(1), [](Coord) { return 1.0; });
  medium.optics.sigma_s = Vec3d(1e-6);
  Scene scene = sunScene(Vec3d(0, 0, -1));
  const double side = 0.5;
  scene.surfaces.push_back({"facet", quad(Vec3d(3, 3, -2), Vec3d(side, 0, 0), Vec3d(0, side, 0)), Vec3d(1)});
  const auto total = [&] {
    FirstScatterSettings settings;
    settings.gather_directions = 2000;
    const FirstScatter light =
        firstScatter(medium, scene, Occluder(scene.surfaces), Model::kDefault, settings);
    double sum = 0;
    for (size_t i = 0; i < light.direct[0].size(); ++i) sum += light.direct[0][i];
    return sum;
  };
  const double open = total();
  const double gap = 3 + 1.2 * side;
  scene.surfaces.push_back({"plate", quad(Vec3d(gap, -9, -1.5), Vec3d(18, 0, 0), Vec3d(0, 18, 0)), Vec3d(0)});
  scene.surfaces.push_back({"plate", quad(Vec3d(-9, gap, -1.5), Vec3d(18, 0, 0), Vec3d(0, 18, 0)), Vec3d(0)});
  const double shaded = total();
  scene.surfaces.resize(1);
  scene.surfaces[0].albedo = Vec3d(0);
  const double sun = total();
  EXPECT_GT(open - sun, 1e-4 * sun);
  EXPECT_GT(shaded - sun, 0.1 * (open - sun)) << "a part of the volume still sees the facet";
}

}  // namespace
}  // namespace vdb_diffuse
