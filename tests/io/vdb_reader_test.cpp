#include "io/vdb_reader.h"

#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <sys/stat.h>

#include <cstdio>
#include <fstream>

#include "io/expect_error.h"
#include "io/temporary_folder.h"
#include "vdb/header.h"

namespace vdb_diffuse {
namespace {

openvdb::FloatGrid::Ptr fog(const std::string& name, float value = 1) {
  auto grid = openvdb::FloatGrid::create();
  grid->setName(name);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->denseFill(openvdb::CoordBBox(Coord(-3), Coord(12)), value, true);
  return grid;
}

class VdbReader : public ::testing::Test {
 protected:
  VdbReader() { openvdb::initialize(); }
  std::string write(const openvdb::GridPtrVec& grids) {
    const std::string path = folder_.file("in.vdb");
    openvdb::io::File(path).write(grids);
    return path;
  }
  TemporaryFolder folder_;
};

// A grid that was let go of is read again from the file that was checked: one that has taken its name, or its
// removal, does not matter.
TEST_F(VdbReader, ReadsAGridAgainFromAFileThatIsReplacedOrRemoved) {
  const std::string path = write({fog("density", 0.5f)});
  const VdbFile file(path);
  const Volume before = file.readDensity();
  file.forget("density");
  const std::string other = folder_.file("other.vdb");
  openvdb::io::File(other).write(openvdb::GridPtrVec{fog("density", 2)});
  ASSERT_EQ(std::rename(other.c_str(), path.c_str()), 0);
  const auto valueNow = [&] { return file.readDensity().values.at(*before.topology, Coord(0, 0, 0)); };
  EXPECT_EQ(valueNow(), 0.5f);
  file.forget("density");
  ASSERT_EQ(std::remove(path.c_str()), 0);
  EXPECT_EQ(valueNow(), 0.5f);
}

TEST_F(VdbReader, RefusesToReadAgainAFileThatWasChangedInItsPlace) {
  const std::string path = write({fog("density")});
  const VdbFile file(path);
  file.readDensity();
  file.forget("density");
  std::ofstream(path, std::ios::app) << "more";
  expectError(ExitStatus::kInputRefused, {path, "changed while it was being read"},
              [&] { file.readDensity(); });
}

TEST_F(VdbReader, ReadsFloatHalfAndDoubleGridsAlike) {
  auto single = fog("density", 0.5f);
  auto half = fog("half", 0.5f);
  half->setSaveFloatAsHalf(true);
  auto twice = openvdb::DoubleGrid::create();
  twice->setName("double");
  twice->denseFill(openvdb::CoordBBox(Coord(-3), Coord(12)), 0.5, true);
  const VdbFile file(write({single, half, twice}));
  for (const char* name : {"density", "half", "double"}) {
    const Volume volume = file.readDensity(name);
    EXPECT_EQ(volume.name, name);
    EXPECT_EQ(volume.topology->activeVoxelCount(), 16u * 16 * 16);
    EXPECT_EQ(volume.values.at(*volume.topology, Coord(-3, 12, 0)), 0.5f);
  }
  for (const GridSummary& grid : file.grids()) {
    EXPECT_EQ(grid.half, grid.name == "half");
    EXPECT_NE(grid.compression.find("active values"), std::string::npos);
  }
}

TEST_F(VdbReader, WithoutADensityTheOnlyFogIsTaken) {
  auto level_set = fog("surface");
  level_set->setGridClass(openvdb::GRID_LEVEL_SET);
  EXPECT_EQ(VdbFile(write({level_set, fog("smoke")})).readDensity().name, "smoke");
  expectError(ExitStatus::kInputRefused, {"dust, smoke", "--density"}, [&] {
    VdbFile(write({fog("smoke"), fog("dust")})).readDensity();
  });
  auto velocity = openvdb::Vec3SGrid::create();
  velocity->setName("velocity");
  expectError(ExitStatus::kInputRefused, {"in.vdb", "surface (level set, float)", "velocity (vec3s)"}, [&] {
    VdbFile(write({level_set, velocity})).readDensity();
  });
}

TEST_F(VdbReader, AMissingGridIsAnsweredWithThoseThatAreThere) {
  const VdbFile file(write({fog("density"), fog("heat")}));
  expectError(ExitStatus::kInputRefused, {"in.vdb", "densty", "did you mean density?", "density, heat"},
              [&] { file.readDensity("densty"); });
}

TEST_F(VdbReader, GridsOfOneNameAreToldApart) {
  const VdbFile file(write({fog("density", 1), fog("density", 2)}));
  ASSERT_EQ(file.grids().size(), 2u);
  float sum = 0;
  for (const GridSummary& grid : file.grids()) {
    const Volume volume = file.readDensity(grid.name);
    sum += volume.values.at(*volume.topology, Coord(0, 0, 0));
  }
  EXPECT_EQ(sum, 3);
}

TEST_F(VdbReader, RefusesWhatIsNoFogVolume) {
  auto level_set = fog("surface");
  level_set->setGridClass(openvdb::GRID_LEVEL_SET);
  auto velocity = openvdb::Vec3SGrid::create();
  velocity->setName("velocity");
  auto count = openvdb::Int32Grid::create();
  count->setName("count");
  auto mask = openvdb::BoolGrid::create();
  mask->setName("mask");
  auto points = openvdb::points::PointDataGrid::create();
  points->setName("drops");
  const VdbFile file(write({level_set, velocity, count, mask, points}));
  ASSERT_EQ(file.grids().size(), 5u);
  const auto refused = [&](const std::string& name, const std::string& why) {
    expectError(ExitStatus::kInputRefused, {"in.vdb", name, why}, [&] { file.readDensity(name); });
  };
  refused("surface", "level set");
  refused("velocity", "vec3s");
  refused("count", "int32");
  refused("mask", "bool");
  refused("drops", "points");
}

TEST_F(VdbReader, RefusesBadValuesWithTheirNumberAndTheFirstAndClampsThemWhenAsked) {
  struct Case {
    float value;
    std::string shown;
  };
  for (const Case& bad : {Case{NAN, "nan"}, Case{INFINITY, "inf"}, Case{-0.25f, "-0.25"}}) {
    auto grid = fog("density");
    grid->tree().setValueOn(Coord(5, 6, 7), bad.value);
    grid->tree().setValueOn(Coord(5, 6, 8), bad.value);
    const VdbFile file(write({grid}));
    expectError(
        ExitStatus::kInputRefused,
        {"in.vdb", "density " + bad.shown + " at (5,6,7) is outside 0..1e30", "2 active values", "--clamp"},
        [&] { file.readDensity(); });
    ReadSettings clamp;
    clamp.clamp = true;
    const Volume volume = file.readDensity("", clamp);
    EXPECT_EQ(volume.values.at(*volume.topology, Coord(5, 6, 7), -1), 0);
    EXPECT_EQ(volume.topology->activeVoxelCount(), 16u * 16 * 16);
  }
}

TEST_F(VdbReader, RefusesValuesThatOverflowWhateverTheSettings) {
  auto grid = fog("density");
  grid->tree().setValueOn(Coord(5, 6, 7), 3e38f);
  const VdbFile file(write({grid}));
  ReadSettings clamp;
  clamp.clamp = true;
  expectError(ExitStatus::kInputRefused, {"3e+38", "(5,6,7)", "1e30", "rescale"},
              [&] { file.readDensity("", clamp); });
}

TEST_F(VdbReader, InactiveValuesMayBeAnything) {
  auto grid = fog("density");
  grid->tree().setValueOff(Coord(5, 6, 7), NAN);
  EXPECT_NO_THROW(VdbFile(write({grid})).readDensity());
}

TEST_F(VdbReader, GiantTilesAreRefusedByTheBudgetAndStillCounted) {
  auto grid = openvdb::FloatGrid::create();
  grid->setName("density");
  for (int n = 0; n < 1000; ++n)
    grid->tree().addTile(3, Coord(4096 * (n % 100), 4096 * (n / 100), 0), 1.f, true);
  const VdbFile file(write({grid}));
  expectError(ExitStatus::kInputRefused,
              {"in.vdb", "density", "68719476736000 active voxels", "1000 active tiles"},
              [&] { file.readDensity(); });
  EXPECT_EQ(file.readCensus("density").active_voxels, 68719476736000u);
}

TEST_F(VdbReader, BudgetOfTheCallerRules) {
  const VdbFile file(write({fog("density")}));
  ReadSettings little;
  little.max_bytes = 1000;
  expectError(ExitStatus::kInputRefused, {"4096 active voxels", "0.001 MB to spare"},
              [&] { file.readDensity("", little); });
}

TEST_F(VdbReader, TruncatedFilesAreRefusedAtEveryLength) {
  const std::string path = write({fog("density"), fog("heat")});
  const std::string whole = contentsOf(path);
  for (size_t length = 0; length < whole.size(); length += 1 + whole.size() / 200) {
    writeText(path, whole.substr(0, length));
    expectError(ExitStatus::kInputRefused, {"in.vdb"}, [&] { VdbFile file(path); });
  }
}

TEST_F(VdbReader, WhatIsNoVdbFileIsRefusedAtOnce) {
  const auto refused = [&](const std::string& path, const std::string& why) {
    expectError(ExitStatus::kInputRefused, {path, why}, [&] { VdbFile file(path); });
  };
  refused(folder_.file("missing.vdb"), "No such file");
  refused(folder_.file(""), "directory");
  writeText(folder_.file("text.vdb"), "this is not a VDB file at all");
  refused(folder_.file("text.vdb"), "not a VDB");
  writeText(folder_.file("empty.vdb"), "");
  refused(folder_.file("empty.vdb"), "not a VDB");
  ASSERT_EQ(::mkfifo(folder_.file("pipe.vdb").c_str(), 0600), 0);
  refused(folder_.file("pipe.vdb"), "not a regular file");
}

TEST_F(VdbReader, FilesWrittenAsAStreamAreRead) {
  const std::string path = folder_.file("stream.vdb");
  std::ofstream out(path, std::ios::binary);
  openvdb::io::Stream(out).write(openvdb::GridPtrVec{fog("density", 3)});
  out.close();
  EXPECT_FALSE(readVdbHeader(path).has_offsets);
  EXPECT_EQ(VdbFile(path).readDensity().topology->activeVoxelCount(), 16u * 16 * 16);
}

TEST_F(VdbReader, VoxelsTooSmallForOpenVdbToMakeAreRead) {
  auto grid = fog("density");
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.03125));
  const std::string path = write({grid});
  std::string bytes = contentsOf(path);
  // The map is stored as doubles: every 2^-5 of it becomes 1e-9, and what derives from it likewise.
  const auto replace = [&](double from, double to) {
    const std::string pattern(reinterpret_cast<const char*>(&from), sizeof from);
    const std::string by(reinterpret_cast<const char*>(&to), sizeof to);
    size_t count = 0;
    for (size_t at = bytes.find(pattern); at != std::string::npos; at = bytes.find(pattern, at), ++count)
      bytes.replace(at, by.size(), by);
    return count;
  };
  ASSERT_GE(replace(0.03125, 1e-9), 3u);
  replace(32, 1e9);
  replace(1024, 1e18);
  replace(16, 5e8);
  writeText(path, bytes);
  EXPECT_NEAR(VdbFile(path).readDensity().transform.meanVoxelSize(), 1e-9, 1e-21);
}

TEST_F(VdbReader, EmissionIsReadOntoTheDensitysVoxels) {
  auto flame = fog("flame", 4);
  flame->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  const VdbFile file(write({fog("density"), flame, fog("same", 2)}));
  const Volume density = file.readDensity();
  const Field<float> same = file.readOnto("same", density), half = file.readOnto("flame", density);
  EXPECT_EQ(same.at(*density.topology, Coord(0, 0, 0)), 2);
  EXPECT_EQ(half.at(*density.topology, Coord(5, 5, 5)), 4);  // its voxel (10,10,10)
  EXPECT_EQ(half.at(*density.topology, Coord(10, 5, 5)), 0);
  expectError(ExitStatus::kInputRefused, {"flam", "did you mean flame"},
              [&] { file.readOnto("flam", density); });
}

// Where the grid has no active voxel a renderer reads its background; between active ones nothing fades.
TEST_F(VdbReader, FactorsAreReadOntoTheDensitysVoxels) {
  auto half = openvdb::Vec3SGrid::create(openvdb::Vec3f(0.25f, 0, 2));  // voxels of 0.5 about the density's
  half->setName("half");
  half->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  half->transform().postTranslate(Vec3d(0.25, 0, 0));
  half->fill(openvdb::CoordBBox(Coord(0), Coord(9)), openvdb::Vec3f(0.5f, -1, 3));
  auto same = openvdb::FloatGrid::create(0.75f);
  same->setName("same");
  same->fill(openvdb::CoordBBox(Coord(-3), Coord(12, 12, 11)), 1.0f);
  same->tree().setValueOn(Coord(1, 2, 3), 1.5f);
  auto empty = fog("density");
  empty->tree().setValueOn(Coord(0, 0, 12), 0);  // of which none is counted
  const VdbFile file(write({empty, half, same}));
  const Volume density = file.readDensity();
  const VdbFile::Factors a = file.readFactorsOnto("same", density), b = file.readFactorsOnto("half", density);
  ASSERT_EQ(a.channels.size(), 1u);
  EXPECT_EQ(a.channels[0].at(*density.topology, Coord(4, 4, 4)), 1);
  EXPECT_EQ(a.channels[0].at(*density.topology, Coord(4, 4, 12)), 0.75f);
  EXPECT_EQ(a.channels[0].at(*density.topology, Coord(1, 2, 3)), 1);
  EXPECT_EQ(a.clamped, 1u);
  EXPECT_EQ(a.outside, 255u);
  EXPECT_EQ(a.background[0], 0.75f);
  ASSERT_EQ(b.channels.size(), 3u);
  for (const auto& [p, value] : {std::pair(Coord(2, 3, 4), openvdb::Vec3f(0.5f, 0, 1)),
                                 std::pair(Coord(5, 4, 4), openvdb::Vec3f(0.5f, 0, 1)),    // between 9 and 10
                                 std::pair(Coord(6, 4, 4), openvdb::Vec3f(0.25f, 0, 1))})  // 11 and 12
    for (int c = 0; c < 3; ++c) EXPECT_EQ(b.channels[c].at(*density.topology, p), value[c]) << p << c;
  EXPECT_EQ(b.outside, 4095u - 6 * 5 * 5);
  EXPECT_EQ(b.clamped, 4095u);
}

TEST_F(VdbReader, FactorsThatAreNoNumbersAreRefused) {
  auto bad = openvdb::Vec3SGrid::create(openvdb::Vec3f(1));
  bad->setName("Cd");
  bad->tree().setValueOn(Coord(5, 6, 7), openvdb::Vec3f(1, NAN, 0));
  auto shape = fog("shape");
  shape->setGridClass(openvdb::GRID_LEVEL_SET);
  auto number = openvdb::Int32Grid::create(1);
  number->setName("number");
  const VdbFile file(write({fog("density"), bad, shape, number}));
  const Volume density = file.readDensity();
  expectError(ExitStatus::kInputRefused, {"in.vdb", "grid Cd", "nan", "(5,6,7)", "--clamp"},
              [&] { file.readFactorsOnto("Cd", density); });
  ReadSettings clamp;
  clamp.clamp = true;
  EXPECT_EQ(file.readFactorsOnto("Cd", density, clamp).channels[1].at(*density.topology, Coord(5, 6, 7)), 0);
  expectError(ExitStatus::kInputRefused, {"grid shape", "level set"},
              [&] { file.readFactorsOnto("shape", density); });
  expectError(ExitStatus::kInputRefused, {"grid number", "holds int32"},
              [&] { file.readFactorsOnto("number", density); });
}

// ---- real volumes

std::string sample(const std::string& name) {
  const char* folder = std::getenv("VDB_DIFFUSE_SAMPLES");
  return folder ? std::string(folder) + "/" + name : "";
}

TEST(VdbSamples, RealCloudsHaveTheVoxelsTheyAreKnownToHave) {
  if (sample("").empty()) GTEST_SKIP() << "VDB_DIFFUSE_SAMPLES names no folder of sample volumes";
  EXPECT_EQ(VdbFile(sample("teapot_cloud.vdb")).readDensity().topology->activeVoxelCount(), 1963736u);
  const VdbFile cloud(sample("wdas_cloud_sixteenth.vdb"));
  const Census counts = cloud.readCensus("density");
  EXPECT_EQ(cloud.readDensity().topology->activeVoxelCount(), 415642u);
  EXPECT_EQ(counts.zeros, 52605u);
  EXPECT_EQ(counts.active_tiles, 130u);
}

TEST(VdbSamples, RealLevelSetAndPointsAreRefused) {
  if (sample("").empty()) GTEST_SKIP() << "VDB_DIFFUSE_SAMPLES names no folder of sample volumes";
  expectError(ExitStatus::kInputRefused, {"ls_sphere", "level set"},
              [] { VdbFile(sample("level_set_sphere.vdb")).readDensity(); });
  expectError(ExitStatus::kInputRefused, {"points.vdb", "holds points"},
              [] { VdbFile(sample("points.vdb")).readDensity(); });
}

}  // namespace
}  // namespace vdb_diffuse
