#include "medium/coarse_medium.h"

#include <gtest/gtest.h>

#include "volumes.h"

namespace vdb_diffuse {
namespace {

/// Negative coordinates, an odd size, and children without and with half of their siblings.
Medium raggedMedium() {
  Medium medium = boxMedium(
      Coord(19, 6, 11), Transform::uniform(0.5, Vec3d(1, 2, 3)),
      [](Coord p) { return p[0] % 3 == 0 ? -1.0 : 0.25 * p[0] + p[1] + 0.1 * p[2]; }, Coord(-9, -3, 5));
  medium.emission.emplace_back(medium.topology());
  forEachVoxel(medium.topology(), [&](Coord p, size_t i) { medium.emission[0][i] = 1.0f + (p[2] & 3); });
  return medium;
}

double sumOver(const Medium& medium, const std::function<double(Coord, size_t)>& term) {
  double sum = 0;
  forEachVoxel(medium.topology(), [&](Coord p, size_t i) { sum += term(p, i); });
  return sum * medium.transform().voxelVolume();
}

TEST(CoarseMedium, MassItsCentreAndPowerStay) {
  const Medium fine = raggedMedium(), coarse = coarsened(fine);
  const auto mass = [](const Medium& m) {
    return sumOver(m, [&](Coord, size_t i) { return m.density.values[i]; });
  };
  EXPECT_NEAR(mass(coarse), mass(fine), 1e-6 * mass(fine));
  const auto power = [](const Medium& m) {
    return sumOver(m, [&](Coord, size_t i) { return m.density.values[i] * m.emission[0][i]; });
  };
  EXPECT_NEAR(power(coarse), power(fine), 1e-6 * power(fine));
}

// As much scatters and absorbs as before, and as much glows, in every colour.
TEST(CoarseMedium, WhatScattersAndWhatGlowsStay) {
  for (const int channels : {1, 3}) {
    Medium fine = raggedMedium();
    fine.optics.sigma_s = Vec3d(1, 0.5, 2);
    fine.optics.sigma_a = Vec3d(0.1, 0, 0.2);
    setAlbedo(
        fine, [](Coord p, int c) { return hashed(p) < 0.3 ? 1 : hashed(p, 1 + c); }, channels);
    const Medium coarse = coarsened(fine);
    ASSERT_EQ(coarse.albedo.size(), static_cast<size_t>(channels));
    for (int c = 0; c < 3; ++c) {
      const auto scatters = [&](const Medium& m) {
        return sumOver(m, [&](Coord, size_t i) { return m.density.values[i] * (*m.albedoIn(c))[i]; });
      };
      const auto absorbs = [&](const Medium& m) {
        return sumOver(m, [&](Coord, size_t i) { return m.density.values[i] * m.absorptionIn(c, i); });
      };
      const auto glows = [&](const Medium& m) {
        return sumOver(m, [&](Coord, size_t i) {
          return m.density.values[i] * m.absorptionIn(c, i) * m.emissionIn(c)[i];
        });
      };
      EXPECT_NEAR(scatters(coarse), scatters(fine), 1e-6 * scatters(fine)) << c;
      EXPECT_NEAR(absorbs(coarse), absorbs(fine), 1e-6 * absorbs(fine)) << c;
      EXPECT_NEAR(glows(coarse), glows(fine), 1e-6 * glows(fine)) << c;
    }
  }
}

TEST(CoarseMedium, AVoxelIsTheCubeOfItsChildren) {
  const Medium fine = raggedMedium(), coarse = coarsened(fine);
  forEachVoxel(coarse.topology(), [&](Coord p, size_t i) {
    double sum = 0;
    int active = 0;
    Vec3d middle(0);
    for (int n = 0; n < 8; ++n) {
      const Coord child(2 * p[0] + (n & 1), 2 * p[1] + (n >> 1 & 1), 2 * p[2] + (n >> 2));
      sum += fine.density.values.at(fine.topology(), child);
      active += fine.topology().isActive(child);
      middle += fine.transform().toWorld(child.asVec3d()) / 8;
    }
    EXPECT_GT(active, 0);
    EXPECT_NEAR(coarse.density.values[i], sum / 8, 1e-6);
    EXPECT_LT((coarse.transform().toWorld(p.asVec3d()) - middle).length(), 1e-12);
  });
  size_t parents = 0;
  forEachVoxel(fine.topology(), [&](Coord p, size_t) {
    parents += !coarse.topology().isActive(Coord(p[0] >> 1, p[1] >> 1, p[2] >> 1));
  });
  EXPECT_EQ(parents, 0u);
  EXPECT_NEAR(coarse.transform().meanVoxelSize(), 1, 1e-12);
}

}  // namespace
}  // namespace vdb_diffuse
