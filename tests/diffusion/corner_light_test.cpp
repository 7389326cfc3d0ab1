#include "diffusion/corner_light.h"

#include <gtest/gtest.h>

#include "volumes.h"

namespace vdb_diffuse {
namespace {

/// A medium of thick voxels that ends in steps: x + z < 0 about the middle of the box.
Medium steps(double depth) {
  constexpr int kWidth = 24;
  Medium medium = boxMedium(Coord(kWidth, kWidth, kWidth), Transform::uniform(1),
                            [](Coord p) { return p[0] + p[2] < kWidth ? 1.0 : -1.0; });
  medium.optics.sigma_s = Vec3d(depth);
  return medium;
}

/// Light in the voxels at the steps, and in those behind them; of the field, away from the box's sides.
std::array<double, 2> lightAtSteps(const Medium& medium, const Field<float>& light) {
  std::array<double, 2> sums{};
  for (int x = 6; x < 18; ++x)
    for (int y = 6; y < 18; ++y)
      for (int behind = 0; behind < 2; ++behind)
        sums[behind] += light.at(medium.topology(), Coord(x, y, 23 - x - behind));
  return sums;
}

// Beams of simple slopes do not slip through where two opaque voxels touch.
TEST(BeamRays, OpaqueStepsAreTight) {
  for (const Vec3d& sun : {Vec3d(-1, 0, -1), Vec3d(-0.5, 0.4, -1), Vec3d(-1, 0.5, -1)}) {
    const Medium medium = steps(1000);
    const FirstScatter light = firstScatter(medium, sunScene(sun), Occluder({}), Model::kDefault);
    const auto [lit, behind] = lightAtSteps(medium, light.direct[0]);
    EXPECT_LT(behind, 1e-3 * lit) << sun;
  }
}

// Of what crosses the corners of opaque voxels seven tenths are taken for scattering at the surface.
TEST(CornerLight, IsGatheredAtTheSurface) {
  for (double depth : {0.9, 4.0, 30.0}) {
    const Medium medium = steps(depth);
    FirstScatterSettings settings;
    settings.want_shape = true;
    const FirstScatter light =
        firstScatter(medium, sunScene(Vec3d(-0.5, 0.4, -1)), Occluder({}), Model::kDefault, settings);
    EquationSettings equation_settings;
    equation_settings.cap = std::numeric_limits<double>::infinity();
    const Equation equation = formEquation(medium, channelOptics(medium, 0, Model::kDefault), 0,
                                           Model::kDefault, equation_settings);
    const Field<float> factor =
        gatherCornerLight(equation, medium, {&light.direct[0], nullptr, &light.shape[0]}, 1);
    Field<float> gathered = light.direct[0];
    double before = 0, after = 0;
    for (size_t i = 0; i < gathered.size(); ++i) {
      before += gathered[i];
      gathered[i] *= factor[i];
      after += gathered[i];
    }
    EXPECT_NEAR(after / before, 1, 1e-5) << depth;
    const auto [lit, behind] = lightAtSteps(medium, light.direct[0]);
    const auto [lit_after, behind_after] = lightAtSteps(medium, gathered);
    if (depth == 0.9) {
      EXPECT_EQ(behind_after, behind);
    }
    if (depth == 30.0) {
      EXPECT_GT(behind, 1e-3 * lit);
      EXPECT_NEAR(behind_after / behind, 0.3, 1e-3);
      EXPECT_NEAR(lit_after + behind_after, lit + behind, 1e-5 * lit);
    }
  }
}

}  // namespace
}  // namespace vdb_diffuse
