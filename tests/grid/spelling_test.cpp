#include "grid/spelling.h"

#include <gtest/gtest.h>

namespace vdb_diffuse {
namespace {

TEST(Spelling, FindsTheNearestWordAndNoneWhereNoneIsNear) {
  const std::vector<std::string> flags{"--sigma-a", "--sigma-s", "--sigma-t", "--density"};
  EXPECT_EQ(nearestSpelling("--sigmas", flags), "--sigma-s");
  EXPECT_EQ(nearestSpelling("--denstiy", flags), "--density");
  EXPECT_EQ(nearestSpelling("--occluder", flags), "");
  EXPECT_EQ(nearestSpelling("xy", {"ab"}), "");
}

}  // namespace
}  // namespace vdb_diffuse
