#include "io/vdb_writer.h"

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <filesystem>

#include "io/atomic_file.h"
#include "io/expect_error.h"
#include "io/temporary_folder.h"
#include "io/vdb_dilate.h"
#include "vdb/header.h"

namespace vdb_diffuse {
namespace {

/// Values that do not compress, so that the file's size follows the voxels.
float roughness(const Coord& p) {
  const uint32_t hash =
      (uint32_t(p[0]) * 73856093u) ^ (uint32_t(p[1]) * 19349663u) ^ (uint32_t(p[2]) * 83492791u);
  return static_cast<float>(hash * 2654435761u >> 8) / (1 << 24);
}

Volume cube(int width, const Transform& transform = Transform::uniform(0.5, Vec3d(1, 2, 3))) {
  std::vector<Coord> origins;
  for (int x = -8; x < width - 8; x += 8)
    for (int y = 0; y < width; y += 8)
      for (int z = 0; z < width; z += 8) origins.emplace_back(x, y, z);
  BlockMask on;
  on.setOn();
  Volume volume;
  volume.topology = std::make_shared<Topology>(origins, std::vector<BlockMask>(origins.size(), on));
  volume.transform = transform;
  volume.values = Field<float>(*volume.topology);
  for (size_t b = 0; b < volume.topology->blockCount(); ++b)
    for (int n = 0; n < kBlockVoxels; ++n)
      volume.values.block(b)[n] = roughness(volume.topology->origin(b) + voxelLocal(n));
  return volume;
}

OutputGrid output(const std::string& name, const Field<float>& field, int channels = 1) {
  OutputGrid grid;
  grid.name = name;
  for (int c = 0; c < channels; ++c) grid.channels.push_back(field);
  return grid;
}

/// Files may grow to so many bytes, no further, in this scope; the disk is full beyond.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    ::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    struct rlimit limit = before_;
    limit.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() { ::setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  struct rlimit before_;
};

TEST(VdbWriter, AVolumeComesBackAsItWas) {
  const TemporaryFolder folder;
  const Volume volume = cube(16);
  writeVolume(folder.file("out.vdb"), volume, {{"made_by", "a test"}});
  const VdbFile file(folder.file("out.vdb"));
  const Volume back = file.readDensity();
  ASSERT_EQ(back.topology->blockCount(), volume.topology->blockCount());
  for (size_t i = 0; i < volume.values.size(); ++i) ASSERT_EQ(back.values[i], volume.values[i]);
  EXPECT_TRUE(sameVoxels(back.transform, volume.transform, *volume.topology));
  bool found = false;
  for (const auto& [name, value] : file.metadata()) found = found || (name == "made_by" && value == "a test");
  EXPECT_TRUE(found);
  EXPECT_EQ(folder.fileCount(), 1u);
}

TEST(VdbWriter, RotatedMirroredAndUnequalVoxelsComeBack) {
  const TemporaryFolder folder;
  const double c = std::cos(0.3), s = std::sin(0.3);
  const Transform transform(Vec3d(2 * c, 2 * s, 0), Vec3d(3 * s, -3 * c, 0), Vec3d(0, 0, 0.5),
                            Vec3d(-7, 8, 9));
  writeVolume(folder.file("out.vdb"), cube(8, transform));
  const Volume back = VdbFile(folder.file("out.vdb")).readDensity();
  for (int a = 0; a < 3; ++a) EXPECT_LT((back.transform.axis(a) - transform.axis(a)).length(), 1e-12);
  EXPECT_LT((back.transform.origin() - transform.origin()).length(), 1e-12);
}

TEST(VdbWriter, GridsCarryTheirTypeUnitAndSettings) {
  const TemporaryFolder folder;
  const Volume volume = cube(8);
  std::vector<OutputGrid> grids{output("diffuse", volume.values), output("flux", volume.values, 3)};
  grids[0].unit = "W/m2/sr";
  grids[0].metadata = {{"sigma_s", 2.5}, {"iterations", 7}, {"method", std::string("multigrid")}};
  WriteSettings settings;
  settings.half = true;
  const WriteReport report = writeVdb(folder.file("out.vdb"), volume, grids, settings);
  EXPECT_TRUE(report.warnings.empty());
  const VdbFile file(folder.file("out.vdb"));
  ASSERT_EQ(file.grids().size(), 2u);
  EXPECT_TRUE(file.grids()[0].half);
  EXPECT_EQ(file.grids()[1].value_type, "vec3s");
  const auto grid = file.readGrid("diffuse");
  EXPECT_EQ(grid->metaValue<std::string>("unit"), "W/m2/sr");
  EXPECT_EQ(grid->metaValue<double>("sigma_s"), 2.5);
  EXPECT_EQ(grid->metaValue<int32_t>("iterations"), 7);
  EXPECT_NE(grid->metaValue<std::string>("program").find("vdb_diffuse"), std::string::npos);
  const GridValues back = file.readValues("diffuse");
  for (size_t i = 0; i < volume.values.size(); ++i)  // half a unit in the last of 11 bits, or of a subnormal
    ASSERT_NEAR(back.channels[0][i], volume.values[i], volume.values[i] / 2048 + 3e-8);
}

TEST(VdbWriter, ValuesBeyondSixteenBitsAreKeptInThirtyTwo) {
  const TemporaryFolder folder;
  Volume volume = cube(8);
  volume.values[3] = 70000;
  WriteSettings settings;
  settings.half = true;
  const WriteReport report =
      writeVdb(folder.file("out.vdb"), volume, {output("diffuse", volume.values)}, settings);
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_NE(report.warnings[0].find("diffuse"), std::string::npos);
  EXPECT_EQ(VdbFile(folder.file("out.vdb")).readValues("diffuse").channels[0][3], 70000);
}

TEST(VdbWriter, TheSourcesGridsPassThroughUnchanged) {
  openvdb::initialize();
  const TemporaryFolder folder;
  auto density = openvdb::FloatGrid::create(0.25f);
  density->setName("density");
  density->setSaveFloatAsHalf(true);
  density->insertMeta("artist", openvdb::StringMetadata("somebody"));
  density->tree().addTile(1, Coord(8, 8, 8), 0.5f, true);
  density->tree().setValueOn(Coord(-1, -2, -3), 0.75f);
  density->tree().setValueOff(Coord(-1, -2, -4), 0.125f);
  density->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
  auto points = openvdb::points::PointDataGrid::create();
  points->setName("drops");
  auto heat = openvdb::FloatGrid::create();
  heat->setName("heat");
  openvdb::io::File(folder.file("in.vdb")).write(openvdb::GridPtrVec{density, points, heat});

  const VdbFile source(folder.file("in.vdb"));
  const Volume volume = source.readDensity();
  writeVdb(folder.file("some.vdb"), volume, {output("diffuse", volume.values)}, {}, &source, {"density"});
  const VdbFile some(folder.file("some.vdb"));
  ASSERT_EQ(some.grids().size(), 2u);
  const auto back = openvdb::gridConstPtrCast<openvdb::FloatGrid>(some.readGrid("density"));
  EXPECT_TRUE(back->tree().hasSameTopology(density->tree()));
  EXPECT_EQ(back->tree().activeTileCount(), 1u);
  EXPECT_EQ(back->background(), 0.25f);
  EXPECT_EQ(back->tree().getValue(Coord(-1, -2, -3)), 0.75f);
  EXPECT_TRUE(back->saveFloatAsHalf());
  EXPECT_EQ(back->metaValue<std::string>("artist"), "somebody");
  EXPECT_EQ(some.readGrid("diffuse")->constTransform(), density->constTransform());

  writeVdb(folder.file("all.vdb"), volume, {output("heat", volume.values)}, {}, &source, {"all"});
  const VdbFile all(folder.file("all.vdb"));
  EXPECT_TRUE(all.has("density") && all.has("drops") && all.has("heat"));
  EXPECT_EQ(all.readCensus("heat").active_voxels, 513u);  // the new one
}

TEST(VdbWriter, RefusesItsOwnInputMissingGridsAndNamesUsedTwice) {
  const TemporaryFolder folder;
  const std::string path = folder.file("in.vdb");
  const Volume volume = cube(8);
  writeVolume(path, volume);
  const std::string before = contentsOf(path);
  const VdbFile source(path);
  ASSERT_EQ(::symlink(path.c_str(), folder.file("link.vdb").c_str()), 0);
  for (const std::string& same : {path, folder.file("link.vdb")})
    expectError(ExitStatus::kUsage, {same, "input"}, [&] { writeVdb(same, volume, {}, {}, &source); });
  const std::string out = folder.file("out.vdb");
  expectError(ExitStatus::kInputRefused, {"in.vdb", "heat", "density"},
              [&] { writeVdb(out, volume, {}, {}, &source, {"heat"}); });
  expectError(ExitStatus::kUsage, {"density"},
              [&] { writeVdb(out, volume, {output("density", volume.values)}, {}, &source, {"density"}); });
  expectError(ExitStatus::kUsage, {"twice"}, [&] {
    writeVdb(out, volume, {output("twice", volume.values), output("twice", volume.values)});
  });
  EXPECT_EQ(contentsOf(path), before);
  EXPECT_EQ(folder.fileCount(), 2u);
}

TEST(VdbWriter, AFullDiskIsAnErrorAtEveryLengthAndHarmsNothing) {
  const TemporaryFolder folder;
  const std::string path = folder.file("out.vdb");
  const Volume small = cube(8), large = cube(32);
  writeVolume(folder.file("whole.vdb"), large);
  const uint64_t whole = readVdbHeader(folder.file("whole.vdb")).bytes;
  writeVolume(path, small);
  const std::string before = contentsOf(path);
  for (int part = 0; part < 40; ++part) {
    const FileSizeLimit limit(whole * part / 40);
    expectError(ExitStatus::kOutputNotWritten, {path}, [&] { writeVolume(path, large); });
  }
  {
    const FileSizeLimit limit(whole - 1);
    expectError(ExitStatus::kOutputNotWritten, {path}, [&] { writeVolume(path, large); });
  }
  EXPECT_EQ(contentsOf(path), before);
  EXPECT_EQ(folder.fileCount(), 2u);
  const FileSizeLimit limit(whole + 1024);
  EXPECT_NO_THROW(writeVolume(path, large));
}

TEST(VdbWriter, WideningFillsFromTheNeighbours) {
  const TemporaryFolder folder;
  Volume volume;
  BlockMask one;
  one.setOn(voxelOffset(0, 0, 0));
  one.setOn(voxelOffset(0, 0, 1));
  volume.topology = std::make_shared<Topology>(std::vector<Coord>{{0, 0, 0}}, std::vector<BlockMask>{one});
  volume.values = Field<float>(*volume.topology);
  volume.values.block(0)[voxelOffset(0, 0, 0)] = 2;
  volume.values.block(0)[voxelOffset(0, 0, 1)] = 6;
  WriteSettings settings;
  settings.dilate = 2;
  writeVdb(folder.file("out.vdb"), volume, {output("diffuse", volume.values)}, settings);
  const GridValues wide = VdbFile(folder.file("out.vdb")).readValues("diffuse");
  const auto at = [&](int x, int y, int z) {
    return wide.channels[0].at(*wide.topology, Coord(x, y, z), -1);
  };
  EXPECT_EQ(wide.topology->activeVoxelCount(), 5u * 5 * 6);
  EXPECT_EQ(at(0, 0, 0), 2);
  EXPECT_EQ(at(0, 0, 1), 6);
  EXPECT_EQ(at(-1, -1, -1), 2);  // touches the first alone, across three block faces
  EXPECT_EQ(at(1, 0, 2), 6);     // touches the second alone
  EXPECT_EQ(at(1, 1, 0), 4);     // touches both
  EXPECT_EQ(at(-2, -2, -2), 2);  // second layer
  EXPECT_EQ(at(2, 2, 3), 6);
}

TEST(VdbWriter, WideningAConstantKeepsItConstant) {
  const Volume volume = cube(16);
  Field<float> constant(*volume.topology, 3);
  const Topology wide = dilatedTopology(*volume.topology);
  const Field<float> field = dilatedField(*volume.topology, constant, wide);
  EXPECT_EQ(wide.activeVoxelCount(), 18u * 18 * 18);
  for (size_t b = 0; b < wide.blockCount(); ++b)
    for (auto voxel = wide.active(b).beginOn(); voxel; ++voxel) ASSERT_EQ(field.block(b)[voxel.pos()], 3);
}

// ---- atomic files

TEST(AtomicFile, NothingAppearsBeforeCommitAndNothingStaysWithout) {
  const TemporaryFolder folder;
  const std::string path = folder.file("out.txt");
  {
    AtomicFile file(path);
    writeText(file.temporary(), "half");
    EXPECT_FALSE(std::filesystem::exists(path));
  }
  EXPECT_EQ(folder.fileCount(), 0u);
  AtomicFile file(path);
  writeText(file.temporary(), "whole");
  file.commit();
  EXPECT_EQ(contentsOf(path), "whole");
  EXPECT_EQ(folder.fileCount(), 1u);
}

TEST(AtomicFile, KeepsPermissionsAndFollowsLinks) {
  const TemporaryFolder folder;
  writeText(folder.file("real.txt"), "old");
  ::chmod(folder.file("real.txt").c_str(), 0640);
  ASSERT_EQ(::symlink("real.txt", folder.file("link.txt").c_str()), 0);
  AtomicFile file(folder.file("link.txt"));
  writeText(file.temporary(), "new");
  file.commit();
  EXPECT_TRUE(std::filesystem::is_symlink(folder.file("link.txt")));
  EXPECT_EQ(contentsOf(folder.file("real.txt")), "new");
  EXPECT_EQ(std::filesystem::status(folder.file("real.txt")).permissions(), std::filesystem::perms(0640));
}

TEST(AtomicFile, RefusesFoldersDevicesAndMissingFolders) {
  const TemporaryFolder folder;
  const auto refused = [](const std::string& path, const std::string& why) {
    expectError(ExitStatus::kOutputNotWritten, {path, why}, [&] { AtomicFile file(path); });
  };
  refused(folder.file(""), "folder");
  std::filesystem::create_directory(folder.file("sub"));
  refused(folder.file("sub"), "directory");
  refused("/dev/null", "not a regular file");
  refused(folder.file("missing/out.vdb"), "No such file");
}

TEST(AtomicFile, AFolderThatMayNotBeWrittenIsAnError) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write anywhere";
  const TemporaryFolder folder;
  ::chmod(folder.file("").c_str(), 0500);
  expectError(ExitStatus::kOutputNotWritten, {"out.vdb", "Permission denied"},
              [&] { AtomicFile file(folder.file("out.vdb")); });
  ::chmod(folder.file("").c_str(), 0700);
}

TEST(AtomicFile, ASignalHandlerCanRemoveWhatIsUnfinished) {
  const TemporaryFolder folder;
  AtomicFile first(folder.file("a")), second(folder.file("b"));
  writeText(folder.file("c"), "finished");
  EXPECT_EQ(folder.fileCount(), 3u);
  removeTemporaryFiles();
  EXPECT_EQ(folder.fileCount(), 1u);
}

TEST(AtomicFile, AFolderStaysOnlyWithSomethingInIt) {
  const TemporaryFolder folder;
  const std::string empty = folder.file("empty"), full = folder.file("full");
  for (const std::string& path : {empty, full}) std::filesystem::create_directory(path);
  writeText(full + "/finished", "a picture");
  {
    const RemovesEmptyFolder first(empty), second(full);
    const AtomicFile unfinished(empty + "/report.png");
    removeTemporaryFiles();  // by a signal
    EXPECT_FALSE(std::filesystem::exists(empty));
    EXPECT_TRUE(std::filesystem::exists(full + "/finished"));
    std::filesystem::create_directory(empty);
  }
  EXPECT_FALSE(std::filesystem::exists(empty));  // by the objects' end
  EXPECT_TRUE(std::filesystem::exists(full + "/finished"));
}

}  // namespace
}  // namespace vdb_diffuse
