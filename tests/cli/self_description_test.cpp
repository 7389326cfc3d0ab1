#include <gtest/gtest.h>

#include "cli/run_program.h"

namespace vdb_diffuse {
namespace {

bool isThere(const std::string& program) {
  return std::system(("command -v " + program + " > /dev/null 2>&1").c_str()) == 0;
}

/// Runs a script of another program; its standard output.
std::string outputOf(const std::string& command) {
  const TemporaryFolder folder;
  const int status = std::system(("(" + command + ") > " + folder.file("out") + " 2>&1 < /dev/null").c_str());
  const std::string out = contentsOf(folder.file("out"));
  EXPECT_EQ(status, 0) << command << ": " << out;
  return out;
}

class Completion : public ::testing::Test {
 protected:
  Completion() {
    const Outcome outcome = runProgram("completion bash");
    EXPECT_EQ(outcome.status, 0) << outcome.error;
    writeText(folder_.file("completion"), outcome.out);
  }
  /// What bash offers for the last of the words, in order of the script.
  std::string offered(const std::string& words) {
    writeText(folder_.file("ask"),
              "source '" + folder_.file("completion") + "'\n" +
                  "function=$(complete -p vdb_diffuse | sed 's/.* -F \\([^ ]*\\) .*/\\1/')\n"
                  "COMP_WORDS=(" +
                  words +
                  ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n"
                  "$function vdb_diffuse\necho \" ${COMPREPLY[*]} \"\n");
    return outputOf("bash '" + folder_.file("ask") + "'");
  }
  TemporaryFolder folder_;
};

TEST_F(Completion, BashTakesTheScriptAndOffersWhatTheHelpLists) {
  if (!isThere("bash")) GTEST_SKIP() << "no bash";
  outputOf("bash -n '" + folder_.file("completion") + "'");
  EXPECT_EQ(offered("vdb_diffuse ba"), " bake \n");
  EXPECT_NE(offered("vdb_diffuse ''").find(" reference render report "), std::string::npos);
  EXPECT_EQ(offered("vdb_diffuse bake --temp"), " --temperature --temperature-scale \n");
  EXPECT_EQ(offered("vdb_diffuse bake cloud.vdb --method ''"), " multigrid blobs \n");
  EXPECT_EQ(offered("vdb_diffuse bake cloud.vdb --method = mu"), " multigrid \n");
  EXPECT_EQ(offered("vdb_diffuse bake -o ''"), "  \n") << "files are bash's own to offer";
  EXPECT_EQ(offered("vdb_diffuse make cl"), " cloud \n");
  EXPECT_NE(offered("vdb_diffuse make cloud --").find(" --voxels "), std::string::npos);
  EXPECT_EQ(offered("vdb_diffuse render --meth"), "  \n") << "which is of bake";
  EXPECT_EQ(offered("vdb_diffuse completion z"), "  \n");
}

// Every option of every command's help, so that none is forgotten by a walk that stops short.
TEST_F(Completion, NoOptionOfTheHelpIsMissing) {
  if (!isThere("bash")) GTEST_SKIP() << "no bash";
  for (const std::string command : {"bake", "reference", "render", "report", "compare", "check", "info"}) {
    const std::string help = runProgram(command + " --help").out;
    const std::string flags = offered("vdb_diffuse " + command + " --");
    size_t count = 0;
    for (size_t at = help.find("\n  -"); at != std::string::npos; at = help.find("\n  -", at + 1)) {
      const std::string names = help.substr(at + 3, help.find_first_of(" \n", at + 3) - at - 3);
      const std::string name = names.substr(names.find("--"));
      EXPECT_NE(flags.find(" " + name + " "), std::string::npos) << command << " " << name;
      ++count;
    }
    EXPECT_GE(count, 4u) << command;
  }
}

TEST_F(Completion, ZshTakesItsScript) {
  const Outcome script = runProgram("completion zsh");
  EXPECT_EQ(script.status, 0) << script.error;
  EXPECT_EQ(script.out.find("#compdef vdb_diffuse\n"), 0u);
  EXPECT_NE(script.out.find(":value:(multigrid blobs)"), std::string::npos);
  if (!isThere("zsh")) GTEST_SKIP() << "no zsh";
  writeText(folder_.file("_vdb_diffuse"), script.out);
  outputOf("zsh -n '" + folder_.file("_vdb_diffuse") + "'");
}

TEST_F(Completion, KnowsTwoShells) {
  expectRefusal(runProgram("completion fish"), 2, {"fish", "bash"});
}

TEST(ManualPage, ManShowsIt) {
  const TemporaryFolder folder;
  const Outcome outcome = runProgram("man");
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  EXPECT_EQ(outcome.out.find(".TH VDB_DIFFUSE 1 "), 0u);
  writeText(folder.file("page.1"), outcome.out);
  if (!isThere("man")) GTEST_SKIP() << "no man";
  const std::string shown =
      outputOf("MANWIDTH=200 LC_ALL=C man --warnings -l '" + folder.file("page.1") + "' | col -b");
  for (const std::string words :
       {"vdb_diffuse - Precomputes the light inside sparse OpenVDB volumes", "--temperature-scale NUMBER",
        "Kelvin per unit of the temperature grid", "--method {multigrid,blobs}",
        "vdb_diffuse render lit.vdb -o 'turn.####.png' --turntable 48",
        "{\"phase\":\"failed\",\"status\":3,\"error\":\"...\"}", "MAKE CLOUD"})
    EXPECT_NE(shown.find(words), std::string::npos) << words;
  EXPECT_EQ(shown.find("warning:"), std::string::npos) << shown.substr(0, 400);
}

}  // namespace
}  // namespace vdb_diffuse
