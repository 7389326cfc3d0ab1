#include <gtest/gtest.h>

#include "cli/run_program.h"

namespace vdb_diffuse {
namespace {

TEST(Program, HelpAndVersionAreEverywhere) {
  for (const std::string command : {"", "bake ", "compare ", "info ", "make ", "render ", "report "}) {
    const Outcome help = runProgram(command + "--help"), version = runProgram(command + "--version");
    EXPECT_EQ(help.status, 0) << command;
    EXPECT_NE(help.out.find("Usage"), std::string::npos) << command;
    EXPECT_EQ(version.status, 0) << command;
    EXPECT_EQ(version.out.find("vdb_diffuse "), 0u) << version.out;
  }
  for (const std::string command : {"compare ", "info "})
    EXPECT_NE(runProgram(command + "--help").out.find("Example:\n  vdb_diffuse " + command),
              std::string::npos);
}

TEST(Program, WithoutACommandItPrintsHelpAndFails) {
  const Outcome outcome = runProgram("");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.error.find("compare"), std::string::npos);
}

TEST(Program, MistypedWordsAreAnsweredWithTheNearest) {
  expectRefusal(runProgram("inof x.vdb"), 2, {"vdb_diffuse: ", "inof", "did you mean info?"});
  expectRefusal(runProgram("info --sigmat 2"), 2,
                {"vdb_diffuse info: ", "--sigmat", "did you mean --sigma-t?"});
  expectRefusal(runProgram("compare --maxrms=3 a b"), 2, {"vdb_diffuse compare: ", "--maxrms", "--max-rms?"});
  expectRefusal(runProgram("info --zzzzzzzz x.vdb"), 2, {"--zzzzzzzz", "--help"});
}

TEST(Program, WrongUseIsOneLineAndTwo) {
  expectRefusal(runProgram("info"), 2, {"vdb_diffuse info: ", "IN"});
  expectRefusal(runProgram("info --sigma-t -1 x.vdb"), 2, {"--sigma-t", "-1"});
  expectRefusal(runProgram("info --sigma-t much x.vdb"), 2, {"--sigma-t", "much"});
}

}  // namespace
}  // namespace vdb_diffuse
