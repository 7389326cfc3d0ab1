#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cli/run_program.h"
#include "io/vdb_writer.h"

namespace vdb_diffuse {
namespace {

/// 16 x 8 x 8 voxels of density 0.5, voxels of side 0.25.
void writeSlab(const std::string& path) {
  BlockMask on;
  on.setOn();
  Volume volume;
  volume.topology =
      std::make_shared<Topology>(std::vector<Coord>{{-8, 0, 0}, {0, 0, 0}}, std::vector<BlockMask>(2, on));
  volume.transform = Transform::uniform(0.25);
  volume.values = Field<float>(*volume.topology, 0.5f);
  writeVolume(path, volume);
}

TEST(Info, CountsVoxelsAndOpticalDepths) {
  const TemporaryFolder folder;
  writeSlab(folder.file("slab.vdb"));
  const Outcome outcome = runProgram("info --json --sigma-t 2 " + folder.file("slab.vdb"));
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  const auto grid = nlohmann::json::parse(outcome.out)["grids"][0];
  EXPECT_EQ(grid["name"], "density");
  EXPECT_EQ(grid["class"], "fog volume");
  EXPECT_EQ(grid["active_voxels"], 1024);
  EXPECT_EQ(grid["leaf_fill"], 1.0);
  EXPECT_EQ(grid["values"]["mean"], 0.5);
  EXPECT_EQ(grid["optical_depth"]["voxel"], 0.25);  // 2 x 0.5 x 0.25
  EXPECT_EQ(grid["optical_depth"]["column"], (std::vector<double>{4, 2, 2}));
  EXPECT_EQ(grid["world_box"][0], (std::vector<double>{-2.125, -0.125, -0.125}));
  EXPECT_EQ(grid["rotated"], false);
  const Outcome text = runProgram("info " + folder.file("slab.vdb"));
  EXPECT_NE(text.out.find("1024"), std::string::npos);
}

TEST(Info, WhatCannotBeReadIsThree) {
  const TemporaryFolder folder;
  expectRefusal(runProgram("info " + folder.file("none.vdb")), 3,
                {"vdb_diffuse info: ", "none.vdb", "No such file"});
  expectRefusal(runProgram("info " + folder.file("")), 3, {"directory"});
}

TEST(Info, StandardOutputThatIsFullIsFive) {
  const TemporaryFolder folder;
  writeSlab(folder.file("slab.vdb"));
  const std::string command =
      std::string(VDB_DIFFUSE_PROGRAM) + " info " + folder.file("slab.vdb") + " > /dev/full 2> /dev/null";
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 5);
}

TEST(Info, ListsRealVolumesOfEveryKind) {
  const char* samples = std::getenv("VDB_DIFFUSE_SAMPLES");
  if (!samples) GTEST_SKIP() << "VDB_DIFFUSE_SAMPLES names no folder of sample volumes";
  const auto describe = [&](const std::string& name) {
    const Outcome outcome = runProgram("info --json " + std::string(samples) + "/" + name);
    EXPECT_EQ(outcome.status, 0) << outcome.error;
    return nlohmann::json::parse(outcome.out)["grids"][0];
  };
  EXPECT_EQ(describe("teapot_cloud.vdb")["active_tiles"], 2326);
  const auto cloud = describe("wdas_cloud_sixteenth.vdb");
  EXPECT_EQ(cloud["active_voxels"], 415642);
  const std::vector<double> columns = cloud["optical_depth"]["column"];
  EXPECT_NEAR(*std::max_element(columns.begin(), columns.end()), 266, 0.5);
  EXPECT_EQ(describe("level_set_sphere.vdb")["class"], "level set");
  EXPECT_EQ(describe("points.vdb")["class"], "points");
}

}  // namespace
}  // namespace vdb_diffuse
