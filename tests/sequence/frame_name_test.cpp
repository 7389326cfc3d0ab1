#include "sequence/frame_name.h"

#include <gtest/gtest.h>

namespace vdb_diffuse {
namespace {

TEST(FrameName, ThreeWaysOfWriting) {
  EXPECT_EQ(frameName("cloud.####.vdb", 7), "cloud.0007.vdb");
  EXPECT_EQ(frameName("cloud.#.vdb", 12), "cloud.12.vdb");
  EXPECT_EQ(frameName("cloud.%04d.vdb", 7), "cloud.0007.vdb");
  EXPECT_EQ(frameName("cloud.%d.vdb", 7), "cloud.7.vdb");
  EXPECT_EQ(frameName("cloud.$F4.vdb", 7), "cloud.0007.vdb");
  EXPECT_EQ(frameName("cloud.$F.vdb", 7), "cloud.7.vdb");
}

TEST(FrameName, LongNumbersAndFolders) {
  EXPECT_EQ(frameName("c.##.vdb", 12345), "c.12345.vdb");
  EXPECT_EQ(frameName("shot/$F4/c.%03d.vdb", 5), "shot/0005/c.005.vdb");
  EXPECT_EQ(frameName("c.####.vdb", -5), "c.-005.vdb");
}

TEST(FrameName, OtherNamesStandForOneFile) {
  for (const std::string name : {"cloud.vdb", "100%.vdb", "a%0x.vdb", "$FPS.vdb", "$F_wide.vdb", ""}) {
    EXPECT_FALSE(hasFrame(name)) << name;
    EXPECT_EQ(frameName(name, 3), name);
  }
  EXPECT_TRUE(hasFrame("a.$F4.vdb"));
  EXPECT_TRUE(hasFrame("a.%04d.vdb"));
  EXPECT_TRUE(hasFrame("a.##.vdb"));
}

}  // namespace
}  // namespace vdb_diffuse
