#include <gtest/gtest.h>

#include "diffusion/diffuse.h"
#include "diffusion/light_result.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

// Voxels of many optical depths: light goes no deeper than its first skin, and without absorption the light
// inside is that of the surface, however thick the voxels are. What a beam leaves too deep by a hundredth of
// a voxel would be held there, and be brighter by its hundreds of optical depths.

Medium box(const Coord& size, double depth) {
  Medium medium = boxMedium(size, Transform::uniform(1), [](Coord) { return 1.0; });
  medium.optics.sigma_s = Vec3d(depth);
  return medium;
}

double mean(const Medium& medium, const Field<float>& field) {
  return sumOverVoxels(medium.topology(), [&](size_t b, int n) { return field.block(b)[n]; }) /
         static_cast<double>(medium.topology().activeVoxelCount());
}

TEST(ThickVoxels, LightDoesNotDependOnHowThickTheyAre) {
  for (const Vec3d& d : {Vec3d(0.3, 0.2, -1), Vec3d(1, 1, -1), Vec3d(0.5, -0.8, -0.3), Vec3d(1, 0.5, -1)}) {
    double first = 0;
    for (double depth : {50.0, 1e3, 1e5}) {
      const Medium medium = box(Coord(14), depth);
      const DiffuseResult lit = diffuse(medium, sunScene(d));
      EXPECT_TRUE(lit.converged);
      EXPECT_EQ(lit.negative_voxels, 0u) << d << " depth " << depth;
      const double light = mean(medium, lit.diffuse[0]);
      if (first == 0) first = light;
      EXPECT_NEAR(light, first, 0.02 * first) << d << " depth " << depth;
    }
  }
}

// P1 below the face of a half space: E / 4 pi times 3 mu^2 + 2 mu; through a slab it falls to nothing, to the
// two thirds of a mean free path beyond it.
TEST(ThickVoxels, BelowAWideFaceLightIsThatOfAHalfSpace) {
  constexpr int kLayers = 5;
  for (const Vec3d& d : {Vec3d(0, 0, -1), Vec3d(0.6, 0.3, -1), Vec3d(1, 0.2, -0.5)}) {
    const double depth = 300, mu = std::abs(d.unit()[2]);
    const Medium medium = box(Coord(40, 40, kLayers), depth);
    const DiffuseResult lit = diffuse(medium, sunScene(d));
    double light = 0;
    for (int n = 0; n < 64; ++n)
      light += lit.diffuse[0].at(medium.topology(), Coord(16 + n / 8, 16 + n % 8, kLayers - 1)) / 64;
    const double deep = (3 * mu * mu + 2 * mu) / (4 * M_PI), through = 1 - 0.5 / kLayers;
    EXPECT_NEAR(light, deep * through, 0.02 * deep) << d;
  }
}

}  // namespace
}  // namespace vdb_diffuse
