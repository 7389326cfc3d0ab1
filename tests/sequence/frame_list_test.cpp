#include "sequence/frame_list.h"

#include <gtest/gtest.h>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

using Frames = std::vector<int>;

TEST(FrameList, RangesAndSteps) {
  EXPECT_EQ(framesIn("7"), (Frames{7}));
  EXPECT_EQ(framesIn("1-4"), (Frames{1, 2, 3, 4}));
  EXPECT_EQ(framesIn("1-10x3"), (Frames{1, 4, 7, 10}));
  EXPECT_EQ(framesIn("1-9:3"), (Frames{1, 4, 7}));
  EXPECT_EQ(framesIn("1-3,5,7-20:2"), (Frames{1, 2, 3, 5, 7, 9, 11, 13, 15, 17, 19}));
  EXPECT_EQ(framesIn("1-100").size(), 100u);
}

TEST(FrameList, CountsDownAndBelowZero) {
  EXPECT_EQ(framesIn("3-1"), (Frames{3, 2, 1}));
  EXPECT_EQ(framesIn("-2-1"), (Frames{-2, -1, 0, 1}));
  EXPECT_EQ(framesIn("-1--3"), (Frames{-1, -2, -3}));
}

TEST(FrameList, AFrameComesOnce) {
  EXPECT_EQ(framesIn("1-3,2-4,1"), (Frames{1, 2, 3, 4}));
}

TEST(FrameList, RefusesWhatItCannotRead) {
  for (const std::string text :
       {"", "a", "1-", "1-5x", "1-5x0", "1,,2", "1,", "1-5y2", "1.5", "1-99999999", "99999999999", " 1"})
    EXPECT_THROW(framesIn(text), UsageError) << text;
}

}  // namespace
}  // namespace vdb_diffuse
