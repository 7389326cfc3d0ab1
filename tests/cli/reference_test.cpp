#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/run_program.h"
#include "io/vdb_reader.h"

namespace vdb_diffuse {
namespace {

std::string smallCloud(const TemporaryFolder& folder) {
  EXPECT_EQ(runProgram("make cloud -o " + folder.file("cloud.vdb") + " --voxels 5000").status, 0);
  return folder.file("cloud.vdb");
}

nlohmann::json statsOf(const std::string& path) {
  std::ifstream in(path);
  return in ? nlohmann::json::parse(in) : nlohmann::json();
}

TEST(Reference, WritesGridsWithStandardErrorsAndStats) {
  const TemporaryFolder folder;
  const std::string cloud = smallCloud(folder), out = folder.file("ref.vdb");
  const Outcome outcome =
      runProgram("reference " + cloud + " -o " + out +
                 " --sun 1,0.5,-1 --sigma-a 0.1 --g 0.6 --noise 0.3 --stats " + folder.file("stats.json"));
  EXPECT_EQ(outcome.status, 0) << outcome.error;
  EXPECT_NE(outcome.out.find("paths, noise"), std::string::npos) << outcome.out;
  const VdbFile file(out);
  ASSERT_EQ(file.grids().size(), 4u);
  for (const char* name : {"density", "diffuse", "direct", "diffuse_se"}) EXPECT_TRUE(file.has(name)) << name;
  const nlohmann::json stats = statsOf(folder.file("stats.json"));
  for (const char* key : {"version", "active_voxels", "voxel_size", "seconds", "peak_bytes", "samples",
                          "scatterings", "batches", "noise", "seed", "energy", "threads", "warnings"})
    EXPECT_TRUE(stats.contains(key)) << key;
  EXPECT_LE(stats["noise"].get<double>(), 0.3);
  EXPECT_LT(std::abs(stats["energy"]["closure"].get<double>()), 1e-9);
  // `compare` finds the standard errors, and the noise that the run claimed.
  const Outcome compared = runProgram("compare " + out + " " + out + " --json");
  EXPECT_EQ(compared.status, 0);
  EXPECT_NEAR(nlohmann::json::parse(compared.out)["noise"].get<double>(), stats["noise"].get<double>(), 1e-4);
}

TEST(Reference, SameBitsForOneAndTwoThreads) {
  const TemporaryFolder folder;
  const std::string cloud = smallCloud(folder);
  const std::string command = "reference " + cloud + " --env 1,2,3 --samples 2e4 --grids diffuse,flux";
  EXPECT_EQ(runProgram(command + " --threads 1 -o " + folder.file("a.vdb")).status, 0);
  EXPECT_EQ(runProgram(command + " --threads 2 -o " + folder.file("b.vdb")).status, 0);
  EXPECT_EQ(runProgram(command + " --seed 2 -o " + folder.file("c.vdb")).status, 0);
  const VdbFile a(folder.file("a.vdb")), b(folder.file("b.vdb")), c(folder.file("c.vdb"));
  for (const char* name : {"diffuse", "flux"}) {
    const GridValues x = a.readValues(name), y = b.readValues(name), z = c.readValues(name);
    ASSERT_EQ(x.channels.size(), 3u);
    bool differs = false;
    for (size_t i = 0; i < x.channels[0].size(); ++i) {
      ASSERT_EQ(x.channels[1][i], y.channels[1][i]) << name;
      differs = differs || x.channels[1][i] != z.channels[1][i];
    }
    EXPECT_TRUE(differs) << name;
  }
}

TEST(Reference, WithoutLightTheResultIsZeroAndSaysSo) {
  const TemporaryFolder folder;
  const Outcome outcome = runProgram("reference " + smallCloud(folder) + " -o " + folder.file("x.vdb"));
  EXPECT_EQ(outcome.status, 0);
  EXPECT_NE(outcome.error.find("no light reaches the volume"), std::string::npos) << outcome.error;
  const GridValues diffuse = VdbFile(folder.file("x.vdb")).readValues("diffuse");
  for (size_t i = 0; i < diffuse.channels[0].size(); ++i) EXPECT_EQ(diffuse.channels[0][i], 0.0f);
}

TEST(Reference, RefusesWithTheRightStatusAndOneLine) {
  const TemporaryFolder folder;
  const std::string cloud = smallCloud(folder), out = " -o " + folder.file("x.vdb");
  expectRefusal(runProgram("reference " + cloud + out + " --noise 0"), 2, {"--noise", "above 0"});
  expectRefusal(runProgram("reference " + cloud + out + " --noise x"), 2, {"--noise", "x"});
  expectRefusal(runProgram("reference " + cloud + out + " --samples -5"), 2, {"--samples"});
  expectRefusal(runProgram("reference " + cloud + out + " --seconds nan"), 2, {"--seconds"});
  expectRefusal(runProgram("reference " + cloud + out + " --grids source"), 2, {"source"});
  expectRefusal(runProgram("reference " + cloud + out + " --grids diffuse_s"), 2,
                {"did you mean diffuse_se"});
  expectRefusal(runProgram("reference " + cloud + " -o " + cloud), 2, {"is the input itself"});
  expectRefusal(runProgram("reference " + cloud + out + " --g 1"), 2, {"--g"});
  expectRefusal(runProgram("reference " + folder.file("none.vdb") + out), 3, {"none.vdb"});
}

}  // namespace
}  // namespace vdb_diffuse
