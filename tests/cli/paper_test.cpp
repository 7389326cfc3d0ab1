#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "cli/run_program.h"

namespace vdb_diffuse {
namespace {

TEST(PaperCommand, APartWritesItsFilesAndItsClaims) {
  const TemporaryFolder folder;
  const std::string out = folder.file("paper");
  const Outcome outcome = runProgram("paper -o " + out + " --only compositing,smoothing --threads 1");
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  EXPECT_EQ(outcome.error, "");
  for (const char* name : {"compositing.csv", "compositing.png", "compositing.svg", "smoothing.csv",
                           "smoothing.png", "smoothing.svg", "claims.csv"})
    EXPECT_GT(contentsOf(out + "/" + name).size(), 100u) << name;
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(out), {}), 7);
  const std::string claims = contentsOf(out + "/claims.csv");
  EXPECT_EQ(claims.rfind("part,section,claim,quantity,measured,criterion,promised,slack,verdict\n", 0), 0u);
  EXPECT_EQ(std::count(claims.begin(), claims.end(), '\n'), 6);
  EXPECT_EQ(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 6);
  EXPECT_NE(outcome.out.find("does not hold"), std::string::npos);
}

TEST(PaperCommand, QuietSaysNothingAndProgressIsJson) {
  const TemporaryFolder folder;
  Outcome outcome = runProgram("paper -o " + folder.file("a") + " --only smoothing --quiet");
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.out + outcome.error, "");
  outcome = runProgram("paper -o " + folder.file("b") + " --only compositing --progress json");
  EXPECT_EQ(outcome.error.rfind("{\"phase\":\"compositing", 0), 0u) << outcome.error;
}

TEST(PaperCommand, RefusesWithTheRightStatusAndOneLine) {
  const TemporaryFolder folder;
  const std::string out = folder.file("paper");
  expectRefusal(runProgram("paper"), 2, {"--output"});
  expectRefusal(runProgram("paper -o " + out + " --only fig33"), 2, {"fig33", "did you mean fig3?"});
  expectRefusal(runProgram("paper -o " + out + " --relaxations 0"), 2, {"--relaxations"});
  EXPECT_FALSE(std::filesystem::exists(out));
  writeText(out, "a file");
  expectRefusal(runProgram("paper -o " + out + " --only smoothing"), 5, {out});
  expectRefusal(runProgram("paper -o " + folder.file("none/paper")), 5, {"none/paper"});
  EXPECT_EQ(contentsOf(out), "a file");
}

TEST(PaperCommand, AnInterruptEndsItAndLeavesNothingHalf) {
  const TemporaryFolder folder;
  const std::string out = folder.file("paper");
  const int result = std::system(("timeout --preserve-status -s INT 1 '" + std::string(VDB_DIFFUSE_PROGRAM) +
                                  "' paper -o " + out + " --only map --threads 1 --effort 100 2> /dev/null")
                                     .c_str());
  EXPECT_EQ(WEXITSTATUS(result), 130);
  EXPECT_FALSE(std::filesystem::exists(out));
}

}  // namespace
}  // namespace vdb_diffuse
