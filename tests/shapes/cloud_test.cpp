#include "shapes/cloud.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <vector>

#include "shapes/volume_checks.h"

namespace vdb_diffuse {
namespace {

Volume cloud(size_t voxels, uint64_t seed = 1) {
  CloudSettings settings;
  settings.size.voxels = voxels;
  settings.seed = seed;
  return makeCloud(settings);
}

double leafFill(const Volume& volume) {
  return double(volume.topology->activeVoxelCount()) / double(kBlockVoxels * volume.topology->blockCount());
}

/// Sizes of the pieces that touch by faces, largest first, in voxels.
std::vector<size_t> pieces(const Volume& volume) {
  const Topology& topology = *volume.topology;
  std::vector<char> seen(volume.values.size());
  std::vector<size_t> sizes;
  const auto indexOf = [&](const Coord& p) {
    return size_t(topology.find(blockOriginOf(p))) * kBlockVoxels + voxelOffset(p[0] & 7, p[1] & 7, p[2] & 7);
  };
  forEachActive(volume, [&](const Coord& start, float) {
    std::vector<Coord> open;
    const auto take = [&](const Coord& p) {
      if (!topology.isActive(p) || seen[indexOf(p)]) return;
      seen[indexOf(p)] = 1;
      open.push_back(p);
    };
    take(start);
    if (open.empty()) return;
    size_t size = 0;
    for (; !open.empty(); ++size) {
      const Coord p = open.back();
      open.pop_back();
      for (int a = 0; a < 3; ++a)
        for (int step : {-1, 1}) {
          Coord next = p;
          next[a] += step;
          take(next);
        }
    }
    sizes.push_back(size);
  });
  std::sort(sizes.rbegin(), sizes.rend());
  return sizes;
}

TEST(Cloud, HoldsAboutAsManyVoxelsAsAsked) {
  for (size_t n : {400, 5000, 60000})
    for (uint64_t seed : {1, 2}) {
      const Volume volume = cloud(n, seed);
      expectSound(volume);
      EXPECT_NEAR(double(volume.topology->activeVoxelCount()), double(n), 0.03 * double(n));
    }
}

TEST(Cloud, IsTheSameToTheBitOnOneThreadAndOnTwo) {
  tbb::global_control two(tbb::global_control::max_allowed_parallelism, 2);
  const Volume parallel = cloud(60000);
  {
    tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    expectSame(parallel, cloud(60000));
  }
  EXPECT_FALSE(isSame(parallel, cloud(60000, 2)));
}

TEST(Cloud, IsTheSameCloudAtEveryResolution) {
  const Volume coarse = cloud(30000), fine = cloud(250000);
  EXPECT_NEAR(massOf(coarse) / massOf(fine), 1, 0.05);
  size_t within = 0, all = 0;
  forEachActive(coarse, [&](const Coord& p, float value) {
    if (value < 2.5f) return;
    const Vec3d at = fine.transform.toIndex(coarse.transform.toWorld(p.asVec3d()));
    ++all;
    within += fine.topology->isActive(Coord::round(at));
  });
  EXPECT_GT(double(within), 0.98 * double(all));
}

TEST(Cloud, StandsOnAFlattishBaseAndIsAboutTenWide) {
  for (uint64_t seed : {1, 2, 3}) {
    const Volume volume = cloud(100000, seed);
    Vec3d low(1e9), high(-1e9);
    double under = 0, all = 0;
    forEachActive(volume, [&](const Coord& p, float value) {
      const Vec3d at = volume.transform.toWorld(p.asVec3d());
      low = openvdb::math::minComponent(low, at);
      high = openvdb::math::maxComponent(high, at);
      all += value;
      if (at[2] < -0.1) under += value;
    });
    EXPECT_GT(low[2], -1);
    EXPECT_LT(under, 0.01 * all);
    EXPECT_GT(high[0] - low[0], 9);
    EXPECT_LT(high[0] - low[0], 14);
    EXPECT_GT(high[2], 3.5);
  }
}

TEST(Cloud, FadesOutAtItsEdgesAndReachesItsPeakInside) {
  const Volume volume = cloud(200000);
  size_t thin = 0, full = 0;
  float peak = 0;
  forEachActive(volume, [&](const Coord&, float value) {
    thin += value < 0.05f * 5;
    full += value > 0.8f * 5;
    peak = std::max(peak, value);
  });
  const double count = double(volume.topology->activeVoxelCount());
  EXPECT_GT(double(thin), 0.15 * count);
  EXPECT_LT(double(thin), 0.4 * count);
  EXPECT_GT(double(full), 0.15 * count);
  EXPECT_LE(peak, 5.0f);
  EXPECT_GT(peak, 4.95f);
}

TEST(Cloud, HasDetachedPieces) {
  for (uint64_t seed : {1, 2, 3}) {
    const Volume volume = cloud(100000, seed);
    const std::vector<size_t> sizes = pieces(volume);
    ASSERT_GT(sizes.size(), 3u);
    EXPECT_GT(double(sizes[0]), 0.8 * 100000);
    EXPECT_GT(double(sizes[2]), 0.0005 * 100000);  // two beside the body that are more than specks
  }
}

TEST(Cloud, FillsAboutHalfOfTheBlocksItTouches) {
  const double small = leafFill(cloud(50000)), large = leafFill(cloud(600000));
  EXPECT_GT(small, 0.2);
  EXPECT_GT(large, 0.4);
  EXPECT_LT(large, 0.65);
}

}  // namespace
}  // namespace vdb_diffuse
