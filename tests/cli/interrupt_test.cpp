#include <gtest/gtest.h>

#include <chrono>

#include "cli/run_program.h"

namespace vdb_diffuse {
namespace {

/// Runs a shell's command line that is interrupted after these seconds; how long it took.
double secondsUntilInterrupted(double after, const std::string& arguments, int& status) {
  const auto start = std::chrono::steady_clock::now();
  const int result = std::system(("timeout --preserve-status -s INT " + std::to_string(after) + " '" +
                                  VDB_DIFFUSE_PROGRAM + "' " + arguments + " 2> /dev/null")
                                     .c_str());
  status = WIFEXITED(result) ? WEXITSTATUS(result) : -1;
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// A sweep of this box takes three seconds on one thread, and looks for no interrupt before its end.
TEST(Interrupt, EndsWithinASecondInTheMiddleOfAStep) {
  const TemporaryFolder folder;
  const std::string box = folder.file("box.vdb"), out = folder.file("lit.vdb"), log = folder.file("log");
  ASSERT_EQ(runProgram("make box -o " + box + " --voxels 2000000").status, 0);
  writeText(out, "old");
  const std::string script = std::string("'") + VDB_DIFFUSE_PROGRAM + "' bake " + box + " -o " + out +
                             " --sun 1,0.5,-1 --g 0.5 --threads 1 --progress json 2> " + log + " & " +
                             "until grep -q sweeps " + log + "; do sleep 0.05; done; sleep 0.3; " +
                             "kill -INT $!; date +%s.%N > " + folder.file("from") + "; wait $!; status=$?; " +
                             "date +%s.%N > " + folder.file("to") + "; exit $status";
  const int result = std::system(script.c_str());
  EXPECT_EQ(WEXITSTATUS(result), 130) << contentsOf(log);
  const double from = std::stod(contentsOf(folder.file("from"))),
               to = std::stod(contentsOf(folder.file("to")));
  EXPECT_LE(to - from, 1);
  EXPECT_EQ(contentsOf(out), "old");
  EXPECT_EQ(folder.fileCount(), 5u);
}

TEST(Interrupt, EndsTheLoopOverFrames) {
  const TemporaryFolder folder;
  const std::string cloud = folder.file("cloud.vdb");
  ASSERT_EQ(runProgram("make cloud -o " + cloud + " --voxels 30000").status, 0);
  int status = 0;
  const double seconds = secondsUntilInterrupted(
      1, "bake " + cloud + " -o '" + folder.file("lit.####.vdb") + "' --sun 1,0.5,-1 --frames 1-1000",
      status);
  EXPECT_EQ(status, 130);
  EXPECT_LE(seconds, 2);
  EXPECT_LT(folder.fileCount(), 100u);
}

}  // namespace
}  // namespace vdb_diffuse
