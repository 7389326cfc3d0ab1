#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/run_program.h"
#include "io/vdb_writer.h"

namespace vdb_diffuse {
namespace {

/// A block of 8^3 voxels with constant grids of these names and values.
void writeConstants(const std::string& path, const std::vector<std::pair<std::string, float>>& constants) {
  BlockMask on;
  on.setOn();
  Volume volume;
  volume.topology = std::make_shared<Topology>(std::vector<Coord>{{0, 0, 0}}, std::vector<BlockMask>{on});
  std::vector<OutputGrid> grids;
  for (const auto& [name, value] : constants) {
    grids.emplace_back();
    grids.back().name = name;
    grids.back().channels.emplace_back(*volume.topology, value);
  }
  writeVdb(path, volume, std::move(grids));
}

class Compare : public ::testing::Test {
 protected:
  Compare() {
    writeConstants(a_, {{"diffuse", 1.25f}, {"odd", NAN}});
    writeConstants(b_, {{"diffuse", 1.f}, {"direct", 2.5f}, {"density", 3.f}});
    writeConstants(noisy_, {{"diffuse", 1.f}, {"diffuse_se", 0.15f}});
  }
  TemporaryFolder folder_;
  std::string a_ = folder_.file("a.vdb"), b_ = folder_.file("b.vdb"), noisy_ = folder_.file("noisy.vdb");
};

TEST_F(Compare, PrintsTheKeysThatScriptsReadAndTheRightNumbers) {
  const Outcome outcome = runProgram("compare --json " + a_ + " " + b_);
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  const auto json = nlohmann::json::parse(outcome.out);
  for (const char* key : {"rel_rms", "bias", "p50", "p95", "p99", "max"}) EXPECT_EQ(json[key], 0.25) << key;
  EXPECT_EQ(json["max_at"], (std::vector<int>{0, 0, 0}));
  EXPECT_EQ(json["noise"], 0);
  EXPECT_EQ(json["nonfinite"], 0);
  EXPECT_EQ(json["within"], true);
  EXPECT_EQ(json.size(), 10u);
}

TEST_F(Compare, LimitsAreFractionsAndDecideTheExitStatus) {
  EXPECT_EQ(runProgram("compare --max-rms 0.26 --max-abs 0.26 " + a_ + " " + b_).status, 0);
  EXPECT_EQ(runProgram("compare --max-rms 0.24 " + a_ + " " + b_).status, 1);
  EXPECT_EQ(runProgram("compare --max-abs 0.24 " + a_ + " " + b_).status, 1);
  EXPECT_EQ(runProgram("compare --max-rms 0 " + b_ + " " + b_).status, 0);
}

TEST_F(Compare, NoiseIsTakenOff) {
  const auto json = nlohmann::json::parse(runProgram("compare --json " + a_ + " " + noisy_).out);
  EXPECT_NEAR(json["noise"].get<double>(), 0.15, 1e-6);
  EXPECT_NEAR(json["rel_rms"].get<double>(), 0.2, 1e-6);
  EXPECT_EQ(runProgram("compare --max-rms 0.21 " + a_ + " " + noisy_).status, 0);
  EXPECT_NE(runProgram("compare " + a_ + " " + noisy_).out.find("noise of B"), std::string::npos);
}

TEST_F(Compare, GridsAreNamedAfterAColon) {
  const auto json =
      nlohmann::json::parse(runProgram("compare --json " + a_ + ":diffuse " + b_ + ":direct").out);
  EXPECT_EQ(json["rel_rms"], 0.5);
  expectRefusal(runProgram("compare " + a_ + ":difuse " + b_), 3, {"a.vdb", "did you mean diffuse?"});
  expectRefusal(runProgram("compare " + a_ + ": " + b_), 2, {"FILE:GRID"});
  std::filesystem::copy_file(b_, folder_.file("b:1.vdb"));  // a colon in a file's own name
  EXPECT_EQ(runProgram("compare " + a_ + " " + folder_.file("b:1.vdb")).status, 0);
}

TEST_F(Compare, WeightsAndCells) {
  const auto json =
      nlohmann::json::parse(runProgram("compare --json --block 4 --weight " + b_ + " " + a_ + " " + b_).out);
  EXPECT_DOUBLE_EQ(json["rel_rms"], 0.25);
}

TEST_F(Compare, ValuesThatAreNotFiniteAreOutsideEveryLimit) {
  const std::string grids = a_ + ":odd " + b_;
  EXPECT_EQ(nlohmann::json::parse(runProgram("compare --json " + grids).out)["nonfinite"], 512);
  EXPECT_EQ(runProgram("compare --max-rms 1 " + grids).status, 1);
}

}  // namespace
}  // namespace vdb_diffuse
