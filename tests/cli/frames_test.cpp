#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/run_program.h"
#include "io/vdb_reader.h"

namespace vdb_diffuse {
namespace {

/// Balls of 1, 2 and 4 as frames of these numbers; 3 is missing.
class Frames : public ::testing::Test {
 protected:
  Frames() {
    EXPECT_EQ(runProgram("make sphere -o " + folder_.file("ball.0001.vdb") + " --voxels 1000").status, 0);
    for (const std::string name : {"ball.0002.vdb", "ball.0004.vdb"})
      std::filesystem::copy_file(folder_.file("ball.0001.vdb"), folder_.file(name));
  }
  Outcome bake(const std::string& flags, const std::string& out = "lit.####.vdb") {
    return runProgram("bake '" + folder_.file("ball.####.vdb") + "' -o '" + folder_.file(out) +
                      "' --sun 0,0,-1 " + flags);
  }
  bool hasFile(const std::string& name) { return std::filesystem::exists(folder_.file(name)); }
  TemporaryFolder folder_;
};

TEST_F(Frames, AMissingOneIsToldInOneLineAndTheOthersAreBaked) {
  const Outcome outcome =
      bake("--frames 1-4 --stats '" + folder_.file("stats.$F2.json") + "'", "lit.%03d.vdb");
  expectRefusal(outcome, 3, {"frame 3", "ball.0003.vdb"});
  EXPECT_NE(outcome.out.find("3 of 4 frames done, not: 3"), std::string::npos) << outcome.out;
  for (const std::string number : {"001", "002", "004"})
    EXPECT_TRUE(hasFile("lit." + number + ".vdb")) << number;
  EXPECT_FALSE(hasFile("lit.003.vdb"));
  for (const std::string number : {"01", "02", "04"})
    EXPECT_TRUE(hasFile("stats." + number + ".json")) << number;
  EXPECT_EQ(folder_.fileCount(), 9u);
}

TEST_F(Frames, TheHighestStatusCounts) {
  EXPECT_EQ(bake("--frames 1-2").status, 0);
  EXPECT_EQ(bake("--frames 1-2 --tolerance 1e-15").status, 4);
  EXPECT_EQ(bake("--frames 1-3 --tolerance 1e-15").status, 4);
  EXPECT_EQ(bake("--frames 1-3").status, 3);
}

TEST_F(Frames, WhatExistsIsSkippedIfAskedFor) {
  EXPECT_EQ(bake("--frames 1").status, 0);
  const auto written = std::filesystem::last_write_time(folder_.file("lit.0001.vdb"));
  const Outcome outcome = bake("--frames 1-2 --skip-existing");
  EXPECT_EQ(outcome.status, 0) << outcome.error;
  EXPECT_NE(outcome.out.find("lit.0001.vdb: exists, skipped"), std::string::npos) << outcome.out;
  EXPECT_EQ(std::filesystem::last_write_time(folder_.file("lit.0001.vdb")), written);
  EXPECT_TRUE(hasFile("lit.0002.vdb"));
}

TEST_F(Frames, EachMayHaveASceneOfItsOwn) {
  for (int frame : {1, 2})
    writeText(folder_.file("scene.000" + std::to_string(frame) + ".json"),
              R"({"lights": [{"type": "sun", "direction": [0,0,-1], "irradiance": )" + std::to_string(frame) +
                  "}]}");
  const Outcome outcome =
      runProgram("bake " + folder_.file("ball.0001.vdb") + " -o '" + folder_.file("lit.####.vdb") +
                 "' --frames 1-2 --scene '" + folder_.file("scene.####.json") + "'");
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  const GridValues once = VdbFile(folder_.file("lit.0001.vdb")).readValues("direct");
  const GridValues twice = VdbFile(folder_.file("lit.0002.vdb")).readValues("direct");
  for (size_t i = 0; i < once.channels[0].size(); ++i)
    ASSERT_FLOAT_EQ(twice.channels[0][i], 2 * once.channels[0][i]);
}

TEST_F(Frames, WithoutANumberInItsNameAnOutputIsRefused) {
  expectRefusal(bake("--frames 1-2", "lit.vdb"), 2, {"-o", "####"});
  expectRefusal(bake("--frames 1-2 --stats " + folder_.file("s.json")), 2, {"--stats", "####"});
  expectRefusal(bake("--frames 1-2y"), 2, {"--frames", "1-2y"});
  EXPECT_EQ(folder_.fileCount(), 3u);
}

TEST_F(Frames, ProgressLinesSayWhichFrameAndHowItEnded) {
  const Outcome outcome = bake("--frames 2-3 --progress json");
  EXPECT_EQ(outcome.status, 3);
  std::istringstream lines(outcome.error);
  std::vector<nlohmann::json> ends;
  for (std::string line; std::getline(lines, line);) {
    if (line[0] != '{') continue;
    const auto json = nlohmann::json::parse(line);
    EXPECT_EQ(json["frames"], 2) << line;
    EXPECT_EQ(json["index"], json["frame"].get<int>() - 2) << line;
    const std::string phase = json["phase"];
    if (phase == "done" || phase == "failed")
      ends.push_back(json);
    else
      EXPECT_TRUE(json["fraction"].is_number()) << line;
  }
  ASSERT_EQ(ends.size(), 2u) << outcome.error;
  EXPECT_EQ(ends[0]["phase"], "done");
  EXPECT_EQ(ends[0]["status"], 0);
  EXPECT_EQ(ends[1]["phase"], "failed");
  EXPECT_EQ(ends[1]["status"], 3);
  EXPECT_NE(ends[1]["error"].get<std::string>().find("ball.0003.vdb"), std::string::npos);
}

}  // namespace
}  // namespace vdb_diffuse
