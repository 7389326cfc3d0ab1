#include <gtest/gtest.h>

#include "diffusion/diffuse.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

constexpr double kStep = 0.5;
const Coord kSize(12, 16, 20);  // voxels; the box covers -h/2 .. (n - 1/2) h

Medium box(const Coord& size = kSize, const Coord& offset = Coord(0)) {
  Medium medium = boxMedium(
      size, Transform::uniform(kStep), [&](Coord p) { return 0.2 + hashed(p + offset); }, offset);
  medium.optics.sigma_s = Vec3d(0.8);
  medium.optics.sigma_a = Vec3d(0.1);
  return medium;
}

DiffuseSettings tight(Model model = Model::kDefault) {
  DiffuseSettings settings;
  settings.model.model = model;
  settings.tolerance = 1e-7;
  return settings;
}

/// Across the middle of the box, between two layers of voxels at right angles to an axis.
Surface plateAcross(int axis, double albedo) {
  Vec3d corner(-2), u(0), v(0);
  corner[axis] = (kSize[axis] / 2 - 0.5) * kStep;
  u[(axis + 1) % 3] = v[(axis + 2) % 3] = 16;
  return {"plate", quad(corner, u, v), Vec3d(albedo)};
}

TEST(Walls, BlackPlateParts) {
  for (int axis = 0; axis < 3; ++axis) {
    const int half = kSize[axis] / 2;
    Scene scene;
    scene.surfaces.push_back(plateAcross(axis, 0));
    const auto glow = [&](Coord p) { return p[axis] < half ? 1.0 : 0.0; };
    Medium whole = box();
    setEmission(whole, glow);
    const DiffuseResult parted = diffuse(whole, scene, tight(Model::kP1));
    Coord size = kSize;
    size[axis] = half;
    Medium lower = box(size);
    setEmission(lower, glow);
    const DiffuseResult alone = diffuse(lower, {}, tight(Model::kP1));
    double worst = 0, largest = 0;
    forEachVoxel(whole.topology(), [&](Coord p, size_t i) {
      const double expected = p[axis] < half ? alone.diffuse[0].at(lower.topology(), p) : 0.0;
      worst = std::max(worst, std::abs(parted.diffuse[0][i] - expected));
      largest = std::max(largest, expected);
    });
    EXPECT_LT(worst, 1e-5 * largest) << "axis " << axis;
    EXPECT_LT(std::abs(parted.energy.closure()), 1e-6);
    EXPECT_NEAR(parted.energy.escaped, alone.energy.escaped, 1e-5 * alone.energy.escaped);
  }
}

// Nothing crosses the plane of symmetry of what is symmetric, so a mirror there changes nothing. A white
// plate is a mirror to P1 alone: the default model knows that outside the medium it throws light back into
// it.
TEST(Walls, MirrorInThePlaneOfSymmetryChangesNothing) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto folded = [&](Coord p) {
      p[axis] = std::min(p[axis], kSize[axis] - 1 - p[axis]);
      return p;
    };
    Medium medium =
        boxMedium(kSize, Transform::uniform(kStep), [&](Coord p) { return 0.2 + hashed(folded(p)); });
    medium.optics.sigma_s = Vec3d(0.8);
    medium.optics.sigma_a = Vec3d(0.1);
    setEmission(medium, [&](Coord p) { return hashed(folded(p), 3); });
    Scene mirror, grey;
    mirror.surfaces.push_back(plateAcross(axis, 1));
    grey.surfaces.push_back(plateAcross(axis, 0.5));
    const DiffuseSettings settings = tight(Model::kP1);
    const DiffuseResult open = diffuse(medium, {}, settings), parted = diffuse(medium, mirror, settings),
                        dimmed = diffuse(medium, grey, settings);
    EXPECT_LT(largestDifference(medium.topology(), parted.diffuse[0], open.diffuse[0]), 1e-5);
    EXPECT_GT(largestDifference(medium.topology(), dimmed.diffuse[0], open.diffuse[0]), 0.05);
  }
}

/// A Marshak wall of albedo R sends back R of what arrives: with J flat beside it the net flux is
/// J (1-R) / (2 (1+R)), by hand in a sealed cube of one voxel that glows.
TEST(Walls, AlbedoSetsTheLossOfAClosedBox) {
  for (double R : {0.0, 0.3, 0.9, 0.999}) {
    Medium medium = boxMedium(Coord(1), Transform::uniform(1), [](Coord) { return 2.0; });
    medium.optics.sigma_s = Vec3d(0.6);
    medium.optics.sigma_a = Vec3d(0.2);
    setEmission(medium, [](Coord) { return 1.0; });
    Scene scene;
    for (int a = 0; a < 3; ++a)
      for (double side : {-0.5, 0.5}) {
        Vec3d corner(-0.5), u(0), v(0);
        corner[a] = side;
        u[(a + 1) % 3] = v[(a + 2) % 3] = 1;
        scene.surfaces.push_back({"side", quad(corner, u, v), Vec3d(R)});
      }
    const DiffuseResult result = diffuse(medium, scene, tight(Model::kP1));
    const double r = 1.5 * 0.8 * 2, loss = 6 / (r + 2 * (1 + R) / (1 - R)), absorbed = 0.2 * 2;
    EXPECT_NEAR(result.diffuse[0].at(medium.topology(), Coord(0)), absorbed / (absorbed + loss), 1e-6) << R;
  }
}

TEST(Walls, PlateCastsAnExactShadow) {
  const Medium medium = box();
  const Scene sun = sunScene(Vec3d(0, 0, -1));
  Scene shaded = sun;  // over the voxels 3 <= x < 8, 5 <= y < 12, high above
  shaded.surfaces.push_back(
      {"plate", quad(Vec3d(2.5 * kStep, 4.5 * kStep, 40), Vec3d(5 * kStep, 0, 0), Vec3d(0, 7 * kStep, 0)),
       Vec3d(0)});
  const DiffuseResult lit = diffuse(medium, sun), shadow = diffuse(medium, shaded);
  double shaded_less = 0;
  forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
    const bool under = p[0] >= 3 && p[0] < 8 && p[1] >= 5 && p[1] < 12;
    ASSERT_EQ(shadow.direct[0][i], under ? 0.0f : lit.direct[0][i]) << p;
    if (under) shaded_less = std::max<double>(shaded_less, shadow.diffuse[0][i] / lit.diffuse[0][i]);
  });
  EXPECT_LT(shaded_less, 1);
  EXPECT_GT(shaded_less, 0);  // light still comes from beside
}

TEST(Walls, PlateBehindTheCloudCastsNoShadow) {
  const Medium medium = box();
  const Scene sun = sunScene(Vec3d(0, 0, -1));
  Scene behind = sun;
  behind.surfaces.push_back({"plate", quad(Vec3d(-9, -9, -3), Vec3d(30, 0, 0), Vec3d(0, 30, 0)), Vec3d(0)});
  const DiffuseResult a = diffuse(medium, sun), b = diffuse(medium, behind);
  EXPECT_EQ(largestDifference(medium.topology(), a.direct[0], b.direct[0]), 0);
  EXPECT_EQ(largestDifference(medium.topology(), a.diffuse[0], b.diffuse[0]), 0);
}

// In a thin medium over a wide white plain under a vertical sun, the plain's radiance E / pi fills the lower
// half of all directions: I_ri0 rises from E / (4 pi) by R E / (2 pi).
TEST(Walls, PlainLightsFromBelow) {
  Medium medium = boxMedium(Coord(8), Transform::uniform(kStep), [](Coord) { return 1e-6; });
  double found[2];
  for (int i = 0; i < 2; ++i) {
    const double R = i ? 0.8 : 0.4;
    Scene scene = sunScene(Vec3d(0, 0, -1));
    scene.surfaces.push_back(
        {"plain", quad(Vec3d(-4000, -4000, -2), Vec3d(8000, 0, 0), Vec3d(0, 8000, 0)), Vec3d(R)});
    const DiffuseResult result = diffuse(medium, scene);
    found[i] = result.direct[0].at(medium.topology(), Coord(4, 4, 4));
    EXPECT_NEAR(found[i], 1 / (4 * M_PI) + R / (2 * M_PI), 1e-3);
  }
  // A cloud above it is lit from below, and coloured by it.
  const Medium cloud = box();
  const Scene sun = sunScene(Vec3d(0, 0, -1));
  Scene red = sun;
  red.surfaces.push_back(
      {"red", quad(Vec3d(-40, -40, -3), Vec3d(80, 0, 0), Vec3d(0, 80, 0)), Vec3d(0.8, 0.1, 0)});
  const DiffuseResult alone = diffuse(cloud, sun), above = diffuse(cloud, red);
  ASSERT_EQ(above.diffuse.size(), 3u);
  const Coord low(6, 8, 0);
  const auto at = [&](const Field<float>& f) { return f.at(cloud.topology(), low); };
  EXPECT_GT(at(above.diffuse[0]), 1.2 * at(alone.diffuse[0]));
  EXPECT_GT(at(above.diffuse[0]), at(above.diffuse[1]));
  EXPECT_GT(at(above.diffuse[1]), at(above.diffuse[2]));
  EXPECT_NEAR(at(above.direct[2]), at(alone.direct[0]), 1e-6 * at(alone.direct[0]));  // black to blue
}

}  // namespace
}  // namespace vdb_diffuse
