#include <gtest/gtest.h>

#include "cli/run_program.h"

namespace vdb_diffuse {
namespace {

/// Bakes as they were accepted. After a change that is meant to move them: look at the pictures, then
/// `vdb_diffuse check tests/regression/small.json --update`.
Outcome check(const std::string& cases, const TemporaryFolder& folder) {
  return runProgram(std::string("check ") + VDB_DIFFUSE_REGRESSION + "/" + cases + " -o " +
                    folder.file("pictures"));
}

TEST(Regression, SmallVolumesOfData) {
  const TemporaryFolder folder;
  const Outcome outcome = check("small.json", folder);
  EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.error;
}

TEST(Regression, RealVolumes) {
  if (!std::getenv("VDB_DIFFUSE_SAMPLES"))
    GTEST_SKIP() << "VDB_DIFFUSE_SAMPLES names no folder of sample volumes";
  const TemporaryFolder folder;
  const Outcome outcome = check("real.json", folder);
  EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.error;
}

}  // namespace
}  // namespace vdb_diffuse
