#include <gtest/gtest.h>

#include "cli/run_program.h"
#include "io/vdb_reader.h"

namespace vdb_diffuse {
namespace {

size_t countOf(const std::string& word, const std::string& text) {
  size_t count = 0;
  for (size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++count;
  return count;
}

/// A ball, and a file of cases that bake it.
class Check : public ::testing::Test {
 protected:
  Check() {
    EXPECT_EQ(runProgram("make sphere -o " + folder_.file("ball.vdb") + " --voxels 3000").status, 0);
  }

  void writeCase(const std::string& bake, const std::string& more = R"("max_rms": 0.002)") {
    writeText(cases_, R"({"cases": [{"name": "noon", "volume": "ball.vdb", "bake": ")" + bake + "\", " +
                          more + "}]}");
  }
  Outcome check(const std::string& flags = "") {
    return runProgram("check " + cases_ + " -o " + pictures_ + " --junit " + junit_ + " " + flags);
  }
  bool hasFile(const std::string& name) { return std::filesystem::exists(folder_.file(name)); }

  TemporaryFolder folder_;
  std::string cases_ = folder_.file("cases.json"), junit_ = folder_.file("junit.xml"),
              pictures_ = folder_.file("pictures");
};

TEST_F(Check, AnAcceptedBakePassesAndAChangedOneDoesNot) {
  writeCase("--sun 0,0,-1");
  EXPECT_EQ(check("--update").status, 0);
  ASSERT_TRUE(hasFile("noon.vdb"));
  const VdbFile stored(folder_.file("noon.vdb"));
  for (const GridSummary& grid : stored.grids()) EXPECT_TRUE(grid.half) << grid.name;
  const Outcome same = check();
  EXPECT_EQ(same.status, 0) << same.out << same.error;
  EXPECT_FALSE(hasFile("pictures"));
  EXPECT_EQ(countOf("<failure", contentsOf(junit_)), 0u);

  writeCase("--sun 0,0,-1 --sun-irradiance 1.01");  // all light grows by 1 %
  const Outcome changed = check();
  EXPECT_EQ(changed.status, 1);
  for (const std::string word :
       {"FAILED  noon", "relative RMS 1 %", "max_rms is 0.2 %", "is stored, now it is"})
    EXPECT_NE(changed.out.find(word), std::string::npos) << word << " in " << changed.out;
  for (const std::string grid : {"diffuse", "direct"}) {
    const std::string picture = contentsOf(pictures_ + "/noon." + grid + ".png");
    EXPECT_EQ(picture.substr(1, 3), "PNG") << grid;
    EXPECT_NE(changed.out.find("noon." + grid + ".png"), std::string::npos);
  }
  const std::string xml = contentsOf(junit_);
  EXPECT_EQ(countOf("<testcase name=\"noon\"", xml), 1u) << xml;
  EXPECT_EQ(countOf("<failure message=\"diffuse: relative RMS", xml), 1u) << xml;
  EXPECT_EQ(countOf("failures=\"1\"", xml), 2u) << xml;

  EXPECT_EQ(check("--update").status, 0);
  EXPECT_EQ(check().status, 0);
}

TEST_F(Check, WhatIsWithinItsLimitsIsNotStoredAnew) {
  writeCase("--sun 0,0,-1");
  EXPECT_EQ(check("--update").status, 0);
  const std::string before = contentsOf(folder_.file("noon.vdb"));
  writeCase("--sun 0,0,-1 --sun-irradiance 1.001");
  EXPECT_EQ(check("--update").status, 0);
  EXPECT_EQ(contentsOf(folder_.file("noon.vdb")), before);
}

TEST_F(Check, LargestDifferenceIsALimitOfItsOwn) {
  writeCase("--sun 0,0,-1", R"("max_rms": 0.02, "max_abs": 0.01)");
  EXPECT_EQ(check("--update").status, 0);
  writeCase("--sun 0,0,-1 --sun-irradiance 1.01", R"("max_rms": 0.02, "max_abs": 0.01)");
  const Outcome changed = check();  // 1 % of the brightest, which is above the mean
  EXPECT_EQ(changed.status, 1);
  EXPECT_NE(changed.out.find("max_abs is 1 %"), std::string::npos) << changed.out;
  EXPECT_EQ(changed.out.find("max_rms is"), std::string::npos) << changed.out;
}

TEST_F(Check, MeansOverCellsTakeLessSpace) {
  writeCase("--sun 0,0,-1", R"("max_rms": 0.002, "block": 4)");
  EXPECT_EQ(check("--update").status, 0);
  EXPECT_EQ(check().status, 0);
  const uint64_t fine = VdbFile(folder_.file("ball.vdb")).readCensus("density").active_voxels;
  const uint64_t coarse = VdbFile(folder_.file("noon.vdb")).readCensus("diffuse").active_voxels;
  EXPECT_LT(coarse, fine / 20);
  writeCase("--sun 0,0,-1", R"("max_rms": 0.002, "block": 2)");  // other cells than those stored
  EXPECT_EQ(check().status, 3);
  EXPECT_EQ(check("--update").status, 0);
  EXPECT_EQ(check().status, 0);
}

TEST_F(Check, ACaseThatCannotRunDoesNotStopTheOthers) {
  writeText(cases_, R"({"defaults": {"bake": "--sun 0,0,-1", "max_rms": 0.01}, "cases": [
      {"name": "gone", "volume": "gone.vdb"}, {"name": "noon", "volume": "ball.vdb"}]})");
  EXPECT_EQ(check("--update").status, 3);
  const Outcome outcome = check();
  EXPECT_EQ(outcome.status, 3);
  EXPECT_NE(outcome.out.find("ok      noon"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.error.find("gone.vdb"), std::string::npos) << outcome.error;
  EXPECT_EQ(countOf("<error", contentsOf(junit_)), 1u);
  EXPECT_EQ(check("--only noon").status, 0);
}

TEST_F(Check, RefusesWithTheRightStatusAndOneLine) {
  writeCase("--sun 0,0,-1");
  expectRefusal(check("--quiet"), 3, {"noon.vdb", "no stored result", "--update"});
  expectRefusal(check("--only night"), 2, {"night", "noon"});
  writeCase("--sunn 0,0,-1");
  expectRefusal(check(), 3, {"noon: bake:", "--sunn"});
  writeCase("-o x.vdb");  // where the result goes is not the case's to say
  expectRefusal(check(), 3, {"noon: bake:", "-o"});
  writeCase("--sun 0,0,-1", R"("max_rmss": 0.01)");
  expectRefusal(check(), 3, {"cases.json: cases[0]", "max_rmss", "did you mean 'max_rms'?"});
  writeCase("--sun 0,0,-1", R"("grids": ["diffuse"])");
  expectRefusal(check(), 3, {"cases[0]", "max_rms or max_abs"});
  writeText(cases_, "{");
  expectRefusal(check(), 3, {"cases.json", "JSON"});
}

}  // namespace
}  // namespace vdb_diffuse
