#include "grid/norms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "io/expect_error.h"

namespace vdb_diffuse {
namespace {

/// A box of voxels with corners `low` and `high`, both inclusive, and values by a function.
GridValues box(const Coord& low, const Coord& high, const std::function<float(const Coord&)>& value,
               int channels = 1) {
  std::vector<Coord> origins;
  std::vector<BlockMask> active;
  const Coord first = blockOriginOf(low);
  for (int x = first[0]; x <= high[0]; x += 8)
    for (int y = first[1]; y <= high[1]; y += 8)
      for (int z = first[2]; z <= high[2]; z += 8) {
        origins.emplace_back(x, y, z);
        active.emplace_back();
        for (int n = 0; n < kBlockVoxels; ++n) {
          const Coord p = origins.back() + voxelLocal(n);
          bool in = true;
          for (int a = 0; a < 3; ++a) in = in && p[a] >= low[a] && p[a] <= high[a];
          if (in) active.back().setOn(n);
        }
      }
  GridValues grid;
  grid.topology = std::make_shared<Topology>(origins, active);
  for (int c = 0; c < channels; ++c) {
    grid.channels.emplace_back(*grid.topology);
    for (size_t b = 0; b < grid.topology->blockCount(); ++b)
      for (auto voxel = grid.topology->active(b).beginOn(); voxel; ++voxel)
        grid.channels[c].block(b)[voxel.pos()] = value(grid.topology->origin(b) + voxelLocal(voxel.pos()));
  }
  return grid;
}

GridValues constant(float value, int channels = 1) {
  return box(
      {-3, 0, 0}, {6, 9, 9}, [=](const Coord&) { return value; }, channels);
}

TEST(Norms, GridAgainstItselfIsZero) {
  const GridValues a = box({-3, 0, 0}, {6, 9, 9}, [](const Coord& p) { return float(p[0] + p[1]); });
  const Norms norms = compareGrids(a, a, nullptr, nullptr, 1);
  EXPECT_EQ(norms.samples, 1000u);
  for (const double n : {norms.rel_rms, norms.bias, norms.p50, norms.p95, norms.p99, norms.max, norms.noise})
    EXPECT_EQ(n, 0);
}

TEST(Norms, ConstantExcessIsThatExcessInEveryNorm) {
  const Norms norms = compareGrids(constant(2.5), constant(2), nullptr, nullptr, 1);
  for (const double n : {norms.rel_rms, norms.bias, norms.p50, norms.p95, norms.p99, norms.max})
    EXPECT_DOUBLE_EQ(n, 0.25);
  EXPECT_EQ(norms.mean, 2);
}

TEST(Norms, OneWrongVoxelIsFoundAndLeavesTheMedianAlone) {
  const Coord wrong(-2, 9, 4);
  const GridValues a = box({-3, 0, 0}, {6, 9, 9}, [&](const Coord& p) { return p == wrong ? 3.f : 2.f; });
  const Norms norms = compareGrids(a, constant(2), nullptr, nullptr, 1);
  EXPECT_EQ(norms.max_at, wrong);
  EXPECT_DOUBLE_EQ(norms.max, 0.5);
  EXPECT_DOUBLE_EQ(norms.rel_rms, std::sqrt(1.0 / (1000 * 4)));
  EXPECT_DOUBLE_EQ(norms.bias, 1.0 / 2000);
  EXPECT_EQ(norms.p99, 0);
}

TEST(Norms, PercentilesOfAKnownLadder) {
  const GridValues b = box({0, 0, 0}, {0, 0, 99}, [](const Coord&) { return 1.f; });
  const GridValues a = box({0, 0, 0}, {0, 0, 99}, [](const Coord& p) { return float(1 + p[2] + 1); });
  const Norms norms = compareGrids(a, b, nullptr, nullptr, 1);
  EXPECT_EQ(norms.p50, 50);
  EXPECT_EQ(norms.p95, 95);
  EXPECT_EQ(norms.p99, 99);
  EXPECT_EQ(norms.max, 100);
}

TEST(Norms, BackgroundStandsInWhereAGridHasNoVoxel) {
  const GridValues a = box({0, 0, 0}, {0, 0, 1}, [](const Coord&) { return 1.f; });
  GridValues b = box({0, 0, 1}, {0, 0, 2}, [](const Coord&) { return 1.f; });
  b.background[0] = 1;  // agrees with a's voxel 0, and a's zero background misses b's voxel 2
  const Norms norms = compareGrids(a, b, nullptr, nullptr, 1);
  EXPECT_EQ(norms.samples, 3u);
  EXPECT_DOUBLE_EQ(norms.rel_rms, std::sqrt(1.0 / 3));
  EXPECT_EQ(norms.max_at, Coord(0, 0, 2));
}

TEST(Norms, NoiseIsTakenOffInQuadrature) {
  const GridValues se = constant(0.4f);
  const Norms norms = compareGrids(constant(2.5), constant(2), &se, nullptr, 1);
  EXPECT_NEAR(norms.noise, 0.2, 1e-7);
  EXPECT_NEAR(norms.rel_rms, 0.15, 1e-7);  // 0.25^2 = 0.2^2 + 0.15^2
  const GridValues large = constant(5);
  EXPECT_EQ(compareGrids(constant(2.5), constant(2), &large, nullptr, 1).rel_rms, 0);
}

TEST(Norms, CellsAverageOppositeErrorsAwayAndNoiseFallsAsTheRootOfTheirVoxels) {
  const auto rough = [](const Coord& p) { return (p[0] + p[1] + p[2]) & 1 ? 3.f : 1.f; };
  const GridValues a = box({-8, -8, -8}, {7, 7, 7}, rough);
  const GridValues b = box({-8, -8, -8}, {7, 7, 7}, [](const Coord&) { return 2.f; });
  const GridValues se = box({-8, -8, -8}, {7, 7, 7}, [](const Coord&) { return 1.f; });
  EXPECT_DOUBLE_EQ(compareGrids(a, b, nullptr, nullptr, 1).rel_rms, 0.5);
  for (const int width : {2, 4, 8}) {
    const Norms norms = compareGrids(a, b, nullptr, nullptr, width);
    EXPECT_NEAR(norms.rel_rms, 0, 1e-12) << width;
    EXPECT_NEAR(compareGrids(a, b, &se, nullptr, width).noise, 0.5 / std::pow(width, 1.5), 1e-12);
  }
  EXPECT_EQ(compareGrids(a, b, nullptr, nullptr, 2).samples, 512u);
}

TEST(Norms, CellsAreAnchoredAtTheOriginAndMayStraddleBlocks) {
  const GridValues a = box({-6, 0, 0}, {11, 0, 0}, [](const Coord& p) { return p[0] == 7 ? 7.f : 1.f; });
  const GridValues b = box({-6, 0, 0}, {11, 0, 0}, [](const Coord&) { return 1.f; });
  const Norms norms = compareGrids(a, b, nullptr, nullptr, 3);  // cells from -6, -3, 0, 3, 6, 9: six of them
  EXPECT_EQ(norms.samples, 6u);
  EXPECT_EQ(norms.max_at, Coord(6, 0, 0));
  EXPECT_NEAR(norms.max, 2, 1e-12);
}

TEST(Norms, WeightsRule) {
  const GridValues b = constant(1);
  const GridValues a = box({-3, 0, 0}, {6, 9, 9}, [](const Coord& p) { return p[0] < 0 ? 9.f : 1.1f; });
  const GridValues weight = box({-3, 0, 0}, {6, 9, 9}, [](const Coord& p) { return p[0] < 0 ? 0.f : 2.f; });
  const Norms norms = compareGrids(a, b, nullptr, &weight, 1);
  EXPECT_NEAR(norms.rel_rms, 0.1, 1e-6);
  EXPECT_NEAR(norms.max, 0.1, 1e-6);
  GridValues bad = weight;
  bad.channels[0].fill(-1);
  expectError(ExitStatus::kInputRefused, {"weight", "not negative"},
              [&] { compareGrids(a, b, nullptr, &bad, 1); });
}

TEST(Norms, ValuesThatAreNotFiniteAreCountedApart) {
  GridValues a = constant(2.5);
  const int32_t block = a.topology->find({0, 0, 0});
  a.channels[0].block(block)[0] = NAN;
  a.channels[0].block(block)[1] = INFINITY;
  for (const int width : {1, 2}) {
    const Norms norms = compareGrids(a, constant(2), nullptr, nullptr, width);
    EXPECT_EQ(norms.nonfinite, 2u);
    EXPECT_DOUBLE_EQ(norms.rel_rms, 0.25);
    EXPECT_DOUBLE_EQ(norms.p50, 0.25);
  }
}

TEST(Norms, GreyMeetsColour) {
  const Norms norms = compareGrids(constant(2.5), constant(2, 3), nullptr, nullptr, 1);
  EXPECT_EQ(norms.samples, 3000u);
  EXPECT_DOUBLE_EQ(norms.rel_rms, 0.25);
}

TEST(Norms, SomethingAgainstNothingIsInfinitelyWrong) {
  EXPECT_TRUE(std::isinf(compareGrids(constant(1), constant(0), nullptr, nullptr, 1).rel_rms));
  EXPECT_EQ(compareGrids(constant(0), constant(0), nullptr, nullptr, 1).rel_rms, 0);
}

TEST(Norms, OtherPlacesInTheWorldAreRefused) {
  GridValues a = constant(1);
  a.transform = Transform::uniform(1.01);
  expectError(ExitStatus::kInputRefused, {"same places"},
              [&] { compareGrids(a, constant(1), nullptr, nullptr, 1); });
}

TEST(Norms, HeaviestColumnCrossesBlocks) {
  const GridValues grid =
      box({-4, 0, 0}, {20, 2, 3}, [](const Coord& p) { return p[1] == 2 && p[2] == 1 ? 2.f : 1.f; });
  EXPECT_EQ(heaviestColumn(*grid.topology, grid.channels[0], 0), 50);
  EXPECT_EQ(heaviestColumn(*grid.topology, grid.channels[0], 1), 4);
  EXPECT_EQ(heaviestColumn(*grid.topology, grid.channels[0], 2), 5);
}

}  // namespace
}  // namespace vdb_diffuse
