#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <sstream>

#include "cli/run_program.h"
#include "io/vdb_writer.h"

namespace vdb_diffuse {
namespace {

using Row = std::map<std::string, std::string>;

std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> parts{""};
  for (const char c : line)
    if (c == ',')
      parts.emplace_back();
    else
      parts.back() += c;
  return parts;
}

std::vector<Row> csv(const std::string& path) {
  std::istringstream in(contentsOf(path));
  std::string line;
  std::getline(in, line);
  const std::vector<std::string> names = cells(line);
  std::vector<Row> rows;
  while (std::getline(in, line)) {
    const std::vector<std::string> values = cells(line);
    EXPECT_EQ(values.size(), names.size()) << line;
    rows.emplace_back();
    for (size_t i = 0; i < std::min(values.size(), names.size()); ++i) rows.back()[names[i]] = values[i];
  }
  return rows;
}

std::vector<Row> rowsOf(const std::vector<Row>& rows, const std::string& method) {
  std::vector<Row> found;
  for (const Row& row : rows)
    if (row.at("method") == method) found.push_back(row);
  return found;
}

/// A small ball in sunlight, of 10 optical depths.
class Report : public ::testing::Test {
 protected:
  Report() { EXPECT_EQ(runProgram("make sphere -o " + ball_ + " --voxels 2000").status, 0); }
  Outcome report(const std::string& flags) {
    return runProgram("report " + ball_ + " -o " + out_ + " --sun 0.3,0.2,-1 --threads 2 " + flags);
  }
  TemporaryFolder folder_;
  std::string ball_ = folder_.file("ball.vdb"), out_ = folder_.file("report");
};

TEST_F(Report, TableAndPictureHoldWhatWasMeasured) {
  const Outcome outcome = report("--noise 0.03 --repeats 1");
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  const std::vector<Row> rows = csv(out_ + "/report.csv");
  for (const std::string method :
       {"paper", "p1", "diffusion", "default", "sweeps4", "blobs", "blob-centres", "blobs1000"}) {
    ASSERT_EQ(rowsOf(rows, method).size(), 1u) << method;
    const Row row = rowsOf(rows, method)[0];
    EXPECT_GT(std::stod(row.at("seconds")), 0) << method;
    EXPECT_GT(std::stod(row.at("monte_carlo_seconds")), 0) << method;
    EXPECT_LT(std::abs(std::stod(row.at("closure"))), 10 * 1e-4) << method;
    EXPECT_GT(std::stoi(row.at("iterations")), 0) << method;
    EXPECT_EQ(row.at("threads"), "2");
    EXPECT_NE(contentsOf(out_ + "/report.svg")
                  .find(method == "p1"      ? "plain P1"
                        : method == "paper" ? "as printed"
                                            : "default"),
              std::string::npos);
  }
  // The printed equations lose a third of the light and more; plain P1 is nearer.
  EXPECT_LT(std::stod(rowsOf(rows, "p1")[0].at("rel_rms")),
            0.5 * std::stod(rowsOf(rows, "paper")[0].at("rel_rms")));
  EXPECT_LT(std::stod(rowsOf(rows, "paper")[0].at("bias")), -0.3);

  // Four times the paths halve the error.
  const std::vector<Row> monte_carlo = rowsOf(rows, "monte-carlo");
  ASSERT_GE(monte_carlo.size(), 2u);
  for (size_t i = 1; i < monte_carlo.size(); ++i) {
    EXPECT_EQ(std::stod(monte_carlo[i].at("samples")), 4 * std::stod(monte_carlo[i - 1].at("samples")));
    const double ratio =
        std::stod(monte_carlo[i].at("rel_rms")) / std::stod(monte_carlo[i - 1].at("rel_rms"));
    EXPECT_NEAR(ratio, 0.5, 0.2) << i;
  }
  ASSERT_EQ(rowsOf(rows, "reference").size(), 1u);
  EXPECT_LT(std::stod(rowsOf(rows, "reference")[0].at("noise")), 0.04);
  ASSERT_EQ(rowsOf(rows, "beams").size(), 1u);
  ASSERT_EQ(rowsOf(rows, "march").size(), 1u);
  EXPECT_LT(std::stod(rowsOf(rows, "beams")[0].at("rel_rms")), 0.1) << "voxels are 0.6 optical depths wide";
  EXPECT_NEAR(std::stod(rowsOf(rows, "beams")[0].at("bias")), -std::stod(rowsOf(rows, "march")[0].at("bias")),
              1e-3);

  EXPECT_EQ(contentsOf(out_ + "/report.png").substr(1, 3), "PNG");
  EXPECT_NE(outcome.out.find("default reaches "), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("Monte Carlo needs "), std::string::npos) << outcome.out;
  EXPECT_EQ(std::count(outcome.out.begin(), outcome.out.end(), '\n'), static_cast<long>(rows.size()) + 2);
}

TEST_F(Report, AnErrorThatTheNoiseHidesIsNotComparedWithMonteCarlo) {
  ASSERT_EQ(runProgram("bake " + ball_ + " -o " + folder_.file("lit.vdb") + " --sun 0.3,0.2,-1").status, 0);
  const Outcome outcome =
      runProgram("report " + ball_ + " -o " + out_ + " --sun 0.3,0.2,-1 --reference " +
                 folder_.file("lit.vdb") + " --methods default,p1,monte-carlo --repeats 1");
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  EXPECT_NE(outcome.out.find("default is nearer to the reference than"), std::string::npos) << outcome.out;

  // Nor is one that has nothing to be compared with taken for one that is hidden.
  const Outcome alone = runProgram("report " + ball_ + " -o " + out_ + "2 --sun 1,0,0 --reference " +
                                   folder_.file("lit.vdb") + " --methods default --repeats 1");
  ASSERT_EQ(alone.status, 0) << alone.error;
  EXPECT_EQ(alone.out.find("is nearer"), std::string::npos) << alone.out;
}

TEST_F(Report, ErrorsAreTheSameAgainstAStoredReferenceForAnyNumberOfThreads) {
  // Any light will do for a reference that is the same each time.
  ASSERT_EQ(
      runProgram("bake " + ball_ + " -o " + folder_.file("lit.vdb") + " --sun 0.3,0.2,-1 --model p1").status,
      0);
  const std::string flags =
      "--reference " + folder_.file("lit.vdb") + " --methods default,p1,monte-carlo --repeats 1 --block 3";
  std::vector<std::vector<Row>> both;
  for (const std::string threads : {" --threads 1", " --threads 2"}) {
    const Outcome outcome =
        runProgram("report " + ball_ + " -o " + out_ + " --sun 0.3,0.2,-1 " + flags + threads);
    ASSERT_EQ(outcome.status, 0) << outcome.error;
    EXPECT_NE(outcome.error.find("diffuse_se"), std::string::npos) << "the noise is not known";
    EXPECT_EQ(outcome.error.find("same lights"), std::string::npos) << outcome.error;
    EXPECT_NE(outcome.out.find("on blocks of 3^3 voxels"), std::string::npos) << outcome.out;
    both.push_back(csv(out_ + "/report.csv"));
  }
  for (const char* name :
       {"rel_rms", "rel_rms_blocks3", "rel_rms_blocks4", "bias", "p95", "max", "iterations"})
    EXPECT_EQ(rowsOf(both[0], "default")[0].at(name), rowsOf(both[1], "default")[0].at(name)) << name;
  for (const char* name : {"rel_rms", "bias", "max"})
    EXPECT_EQ(rowsOf(both[0], "monte-carlo")[0].at(name), rowsOf(both[1], "monte-carlo")[0].at(name)) << name;
  EXPECT_LT(std::stod(rowsOf(both[0], "p1")[0].at("rel_rms")), 1e-3) << "the reference is this very method";
  EXPECT_TRUE(rowsOf(both[0], "beams").empty());
}

TEST_F(Report, RefusesWithTheRightStatusAndOneLine) {
  const std::string cheap = "--noise 0.5 --repeats 1 ";
  expectRefusal(report("--methods defalt"), 2, {"defalt", "did you mean default?"});
  expectRefusal(report("--noise 0"), 2, {"--noise"});
  expectRefusal(report("--noise 0.1 --reference x.vdb"), 2, {"--reference", "--noise"});
  expectRefusal(report("--tolerance 2"), 2, {"--tolerance"});
  expectRefusal(runProgram("report " + ball_ + " -o " + out_), 2, {"no light", "--sun"});
  expectRefusal(report(cheap + "--sun-irradiance 0"), 3, {"ball.vdb", "dark"});
  expectRefusal(report("--reference " + folder_.file("none.vdb")), 3, {"none.vdb"});
  expectRefusal(report("--reference " + ball_), 3, {"ball.vdb", "diffuse"});
  expectRefusal(runProgram("report " + folder_.file("none.vdb") + " -o " + out_ + " --sun 0,0,-1"), 3,
                {"none.vdb"});
  EXPECT_FALSE(std::filesystem::exists(out_)) << "a folder made for nothing is taken away";
  expectRefusal(runProgram("report " + ball_ + " -o " + ball_ + " --sun 0,0,-1"), 5, {"ball.vdb"});
  expectRefusal(runProgram("report " + ball_ + " -o " + folder_.file("a/b") + " --sun 0,0,-1"), 5, {"a/b"});
}

TEST_F(Report, AReferenceOfOtherVoxelsOrOpticsIsRefused) {
  const std::string lit = folder_.file("lit.vdb"), other = folder_.file("other.vdb");
  ASSERT_EQ(runProgram("bake " + ball_ + " -o " + lit + " --sun 0,0,-1 --g 0.5").status, 0);
  expectRefusal(report("--reference " + lit), 3, {"lit.vdb", "g 0.5"});
  ASSERT_EQ(runProgram("make sphere -o " + other + " --voxels 3000").status, 0);
  ASSERT_EQ(runProgram("bake " + other + " -o " + lit + " --sun 0,0,-1").status, 0);
  expectRefusal(report("--reference " + lit), 3, {"lit.vdb", "diffuse", "voxels"});
}

TEST_F(Report, AReferenceInAnotherLightIsDoubted) {
  const std::string lit = folder_.file("lit.vdb");
  ASSERT_EQ(runProgram("bake " + ball_ + " -o " + lit + " --sun 0.3,0.2,-1 --sun-irradiance 2").status, 0);
  const Outcome outcome = report("--methods default --repeats 1 --reference " + lit);
  EXPECT_EQ(outcome.status, 0);
  EXPECT_NE(outcome.error.find("50 % darker: was it made with the same lights?"), std::string::npos)
      << outcome.error;
}

TEST_F(Report, AnUnreachedToleranceIsStatus4AndWrittenAndAFailureKeepsWhatWasThere) {
  const Outcome outcome = report("--noise 0.5 --methods default --repeats 1 --tolerance 1e-30");
  EXPECT_EQ(outcome.status, 4);
  EXPECT_NE(outcome.error.find("did not reach the tolerance"), std::string::npos) << outcome.error;
  const std::string before = contentsOf(out_ + "/report.csv");
  EXPECT_EQ(rowsOf(csv(out_ + "/report.csv"), "default").at(0).at("converged"), "0");
  EXPECT_EQ(report("--sun-irradiance 0 --noise 0.5").status, 3);
  EXPECT_EQ(contentsOf(out_ + "/report.csv"), before);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(out_), {}), 3);
}

}  // namespace
}  // namespace vdb_diffuse
