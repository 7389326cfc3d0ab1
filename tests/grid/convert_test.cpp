#include "grid/convert.h"
#include "grid/census.h"

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include "io/expect_error.h"

namespace vdb_diffuse {
namespace {

constexpr uint64_t kPlenty = uint64_t(1) << 30;

/// A value that tells its voxel.
float valueAt(const Coord& p) {
  return static_cast<float>(1000 + p[0] + 0.5 * p[1] + 0.25 * p[2]);
}

openvdb::FloatGrid::Ptr leavesAndTiles() {
  auto grid = openvdb::FloatGrid::create(7);
  grid->setName("density");
  for (const Coord& p : {Coord(-1, -1, -1), Coord(-9, 3, 200), Coord(0, 0, 0), Coord(5, -4000, 3)})
    grid->tree().setValueOn(p, valueAt(p));
  grid->tree().setValueOff(Coord(1, 1, 1), 99);  // an inactive voxel that is not background
  grid->tree().addTile(1, Coord(-24, 8, 16), 2.5f, true);
  grid->tree().addTile(2, Coord(1024, -2048, 0), 3.5f, true);
  grid->tree().addTile(1, Coord(64, 64, 64), 4.5f, false);
  return grid;
}

TEST(Convert, KeepsEveryActiveVoxelOfLeavesAndTilesOfTwoLevels) {
  const auto grid = leavesAndTiles();
  const GridValues values = valuesOf(*grid, kPlenty);
  EXPECT_EQ(values.topology->activeVoxelCount(), grid->activeVoxelCount());
  EXPECT_EQ(values.background[0], 7);
  for (auto voxel = grid->tree().cbeginValueOn(); voxel; ++voxel) {
    const Coord p = voxel.getCoord();
    ASSERT_TRUE(values.topology->isActive(p));
    ASSERT_EQ(values.channels[0].at(*values.topology, p), *voxel);
  }
  const Coord last(1024 + 127, -2048 + 127, 127);  // the far corner of the 128^3 tile
  EXPECT_EQ(values.channels[0].at(*values.topology, last), 3.5f);
  EXPECT_FALSE(values.topology->isActive(last.offsetBy(1, 0, 0)));
}

TEST(Convert, InactiveVoxelsHoldZeroWhateverTheTreeHolds) {
  const GridValues values = valuesOf(*leavesAndTiles(), kPlenty);
  EXPECT_EQ(values.channels[0].at(*values.topology, Coord(1, 1, 1), -1), 0);
  EXPECT_EQ(values.channels[0].at(*values.topology, Coord(2, 1, 1), -1), 0);
}

TEST(Convert, RoundTripGivesTheSameTree) {
  for (const int components : {1, 3}) {
    openvdb::GridBase::Ptr grid = leavesAndTiles();
    if (components == 3) {
      auto colours = openvdb::Vec3SGrid::create();
      colours->tree().setValueOn(Coord(-3, 4, 5), openvdb::Vec3f(1, 2, 3));
      colours->tree().addTile(1, Coord(8, 8, 8), openvdb::Vec3f(4, 5, 6), true);
      grid = colours;
    }
    const GridValues there = valuesOf(*grid, kPlenty);
    ASSERT_EQ(there.channels.size(), size_t(components));
    const GridValues back = valuesOf(*gridOf(*there.topology, there.channels, there.transform), kPlenty);
    ASSERT_EQ(back.topology->blockCount(), there.topology->blockCount());
    for (size_t b = 0; b < back.topology->blockCount(); ++b) {
      ASSERT_EQ(back.topology->origin(b), there.topology->origin(b));
      ASSERT_EQ(back.topology->active(b), there.topology->active(b));
    }
    for (int c = 0; c < components; ++c)
      for (size_t i = 0; i < there.channels[c].size(); ++i)
        ASSERT_EQ(back.channels[c][i], there.channels[c][i]);
  }
}

TEST(Convert, GiantTilesAreRefusedByTheirSizeBeforeAnyMemoryIsTaken) {
  auto grid = openvdb::FloatGrid::create();
  grid->setName("density");
  grid->tree().addTile(3, Coord(0, 0, 0), 1.f, true);  // 4096^3 voxels
  expectError(ExitStatus::kInputRefused, {"density", "68719476736 active voxels", "1 active tiles", "MB"},
              [&] { valuesOf(*grid, kPlenty); });
}

TEST(Convert, BudgetIsTheMemoryThatBlocksTake) {
  auto grid = openvdb::FloatGrid::create();
  grid->tree().addTile(2, Coord(0, 0, 0), 1.f, true);  // 4096 blocks of 2048 bytes and their places
  EXPECT_NO_THROW(valuesOf(*grid, 12 << 20));
  EXPECT_THROW(valuesOf(*grid, 8 << 20), InputError);
}

TEST(Convert, VoxelsBeyondTheRangeOfCoordinatesAreRefused) {
  auto grid = openvdb::FloatGrid::create();
  grid->tree().setValueOn(Coord(0, (1 << 30) + 1, 0), 1.f);
  expectError(ExitStatus::kInputRefused, {"2^30", "1073741825"}, [&] { valuesOf(*grid, kPlenty); });
}

TEST(Convert, OtherTypesAreRefusedByName) {
  auto grid = openvdb::Int32Grid::create();
  grid->setName("count");
  expectError(ExitStatus::kInputRefused, {"count", "int32"}, [&] { valuesOf(*grid, kPlenty); });
}

TEST(Convert, CensusCountsTilesByTheirVoxelsAndPartsBadValuesFromGoodOnes) {
  auto grid = openvdb::FloatGrid::create();
  grid->tree().addTile(1, Coord(0, 0, 0), 2.f, true);
  grid->tree().addTile(3, Coord(4096, 0, 0), 0.f, true);
  grid->tree().setValueOn(Coord(-1, 0, 0), -4.f);
  grid->tree().setValueOn(Coord(-2, 0, 0), NAN);
  const Census counts = census(*grid);
  const uint64_t giant = uint64_t(1) << 36;
  EXPECT_EQ(counts.active_voxels, giant + 512 + 2);
  EXPECT_EQ(counts.tiles_by_width, (std::vector<uint64_t>{1, 0, 1}));
  EXPECT_EQ(counts.zeros, giant);
  EXPECT_EQ(counts.negatives, 1u);
  EXPECT_EQ(counts.nonfinites, 1u);
  EXPECT_EQ(counts.lowest_value, -4);
  EXPECT_EQ(counts.highest_value, 2);
  EXPECT_NEAR(counts.mean, (512 * 2 - 4) / (double(giant) + 513), 1e-20);
}

// ---- transforms

openvdb::FloatGrid::Ptr withMatrix(const openvdb::Mat4d& matrix) {
  auto grid = openvdb::FloatGrid::create();
  grid->setName("density");
  grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  return grid;
}

TEST(Convert, TransformsAgreeWithOpenVdbBothWays) {
  openvdb::Mat4d rotated = openvdb::Mat4d::identity(), mirrored = openvdb::Mat4d::identity();
  rotated.preScale(Vec3d(0.5, 2, 3));
  rotated.postRotate(openvdb::math::X_AXIS, 0.7);
  rotated.postRotate(openvdb::math::Z_AXIS, -1.1);
  rotated.postTranslate(Vec3d(10, -20, 30));
  mirrored.preScale(Vec3d(0.1, -0.1, 0.1));
  mirrored.postTranslate(Vec3d(1, 2, 3));
  openvdb::Mat4d uniform = openvdb::Mat4d::identity();
  uniform.preScale(Vec3d(0.25));
  for (const openvdb::Mat4d& matrix : {rotated, mirrored, uniform}) {
    const auto grid = withMatrix(matrix);
    const Transform ours = transformOf(*grid);
    const auto back = openvdbTransform(ours);
    for (const Vec3d& p : {Vec3d(0), Vec3d(1, 0, 0), Vec3d(-3, 5, 7.5), Vec3d(1000, -2000, 3000)}) {
      const Vec3d expected = grid->constTransform().indexToWorld(p);
      EXPECT_LT((ours.toWorld(p) - expected).length(), 1e-9);
      EXPECT_LT((back->indexToWorld(p) - expected).length(), 1e-9);
      EXPECT_LT((ours.toIndex(expected) - p).length(), 1e-9);
    }
  }
}

TEST(Convert, UniformTransformIsWrittenAsTheMapThatEveryReaderKnows) {
  EXPECT_EQ(openvdbTransform(Transform::uniform(0.5, Vec3d(1, 2, 3)))->mapType(), "UniformScaleTranslateMap");
  EXPECT_EQ(openvdbTransform(Transform::uniform(0.5))->mapType(), "UniformScaleMap");
}

TEST(Convert, ShearedAndFrustumTransformsAreRefused) {
  openvdb::Mat4d sheared = openvdb::Mat4d::identity();
  sheared(0, 1) = 0.01;
  expectError(ExitStatus::kInputRefused, {"density", "sheared"}, [&] { transformOf(*withMatrix(sheared)); });
  auto frustum = openvdb::FloatGrid::create();
  frustum->setTransform(
      openvdb::math::Transform::createFrustumTransform(openvdb::BBoxd(Vec3d(0), Vec3d(100)), 0.5, 10, 1));
  expectError(ExitStatus::kInputRefused, {"perspective"}, [&] { transformOf(*frustum); });
}

TEST(Convert, VoxelsLikeNeedlesOrLeavesAreRefused) {
  for (const auto& [size, taken] : {std::pair(Vec3d(1, 1, 900), true),
                                    {Vec3d(30, 1, 0.05), true},
                                    {Vec3d(1, 1, 1e15), false},
                                    {Vec3d(1, 1e-15, 1), false},
                                    {Vec3d(50, 1, 0.04), false}}) {
    openvdb::Mat4d matrix = openvdb::Mat4d::identity();
    matrix.preScale(size * 1e6);  // OpenVDB itself refuses the smallest voxels
    if (taken)
      EXPECT_NEAR(transformOf(*withMatrix(matrix)).axis(2).length(), 1e6 * size[2], 1);
    else
      expectError(ExitStatus::kInputRefused, {"density", "times as long as wide"},
                  [&, m = matrix] { transformOf(*withMatrix(m)); });
  }
}

// ---- sampling

Volume volumeOf(const openvdb::FloatGrid& grid) {
  GridValues values = valuesOf(grid, kPlenty);
  return {"density", values.topology, values.transform, std::move(values.channels[0])};
}

TEST(Convert, SamplingOnTheSameVoxelsIsAPlainCopy) {
  const auto grid = leavesAndTiles();
  const Volume volume = volumeOf(*grid);
  const Field<float> copy = sampleOnto(*grid, volume);
  for (size_t i = 0; i < copy.size(); ++i) ASSERT_EQ(copy[i], volume.values[i]);
}

TEST(Convert, TrilinearSamplingIsExactForALinearFunction) {
  auto source = openvdb::DoubleGrid::create();
  source->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  source->denseFill(openvdb::CoordBBox(Coord(-20), Coord(20)), 0.0, true);
  for (auto voxel = source->tree().beginValueOn(); voxel; ++voxel) {
    const Vec3d p = source->constTransform().indexToWorld(voxel.getCoord());
    voxel.setValue(100 + p[0] - 2 * p[1] + 3 * p[2]);
  }
  auto target = openvdb::FloatGrid::create();
  openvdb::Mat4d matrix = openvdb::Mat4d::identity();
  matrix.preScale(Vec3d(0.31, 0.7, -0.45));
  matrix.postRotate(openvdb::math::Y_AXIS, 0.4);
  matrix.postTranslate(Vec3d(0.1, 0.2, 0.3));
  target->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  target->denseFill(openvdb::CoordBBox(Coord(-5), Coord(5)), 1.f, true);
  const Volume volume = volumeOf(*target);
  const Field<float> sampled = sampleOnto(*source, volume);
  for (auto voxel = target->tree().cbeginValueOn(); voxel; ++voxel) {
    const Vec3d p = target->constTransform().indexToWorld(voxel.getCoord());
    EXPECT_NEAR(sampled.at(*volume.topology, voxel.getCoord()), 100 + p[0] - 2 * p[1] + 3 * p[2], 1e-4);
  }
}

TEST(Convert, SamplingFarOutsideGivesZero) {
  const auto source = leavesAndTiles();
  auto target = openvdb::FloatGrid::create();
  target->setTransform(openvdb::math::Transform::createLinearTransform(1e9));
  target->tree().setValueOn(Coord(100, 100, 100), 1.f);
  const Volume volume = volumeOf(*target);
  EXPECT_EQ(sampleOnto(*source, volume).at(*volume.topology, Coord(100, 100, 100), -1), 0);
}

TEST(Convert, InterpolationDoesNotFadeWhereTheGridEnds) {
  const auto coarse = openvdb::FloatGrid::create();
  coarse->setTransform(openvdb::math::Transform::createLinearTransform(2.0));
  coarse->denseFill(openvdb::CoordBBox(Coord(0), Coord(3)), 5.f, true);
  const auto fine = openvdb::FloatGrid::create();
  fine->denseFill(openvdb::CoordBBox(Coord(-1), Coord(7)), 1.f, true);
  const Volume volume = volumeOf(*fine);
  const Channels values = interpolateOnto(*coarse, volume);
  const Field<float> sampled = sampleOnto(*coarse, volume);
  const auto at = [&](const Field<float>& f, const Coord& p) { return f.at(*volume.topology, p, -1); };
  EXPECT_EQ(at(values[0], Coord(3, 3, 3)), 5);
  EXPECT_EQ(at(values[0], Coord(7, 7, 7)), 5);
  EXPECT_NEAR(at(sampled, Coord(7, 3, 3)), 2.5, 1e-6);  // half a voxel out, along one axis
}

}  // namespace
}  // namespace vdb_diffuse
