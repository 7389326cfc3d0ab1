#include "medium/turned_block.h"

#include <gtest/gtest.h>

#include "volumes.h"

namespace vdb_diffuse {
namespace {

TEST(TurnedBlock, HasTheRowsAlongYAndTurnsBack) {
  alignas(64) float block[kBlockVoxels], turned[kBlockVoxels], back[kBlockVoxels], twice[kBlockVoxels];
  for (int n = 0; n < kBlockVoxels; ++n) block[n] = twice[n] = static_cast<float>(n);
  turnBlock(block, turned);
  turnBack(turned, back);
  addTurnedBack(turned, twice);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z) {
        const int n = voxelOffset(x, y, z);
        EXPECT_EQ(turned[z * 64 + x * 8 + y], block[n]);
        EXPECT_EQ(back[n], block[n]);
        EXPECT_EQ(twice[n], 2 * block[n]);
      }
}

TEST(TurnedBlock, RowsOfAMaskTurnAlike) {
  BlockMask mask;
  for (int n = 0; n < kBlockVoxels; ++n)
    if (hashed(voxelLocal(n)) < 0.4) mask.setOn(n);
  const RowBits bits(mask);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z) {
        const bool on = mask.isOn(voxelOffset(x, y, z));
        EXPECT_EQ(bits.plain[x * 8 + y] >> z & 1, on);
        EXPECT_EQ(bits.turned[z * 8 + x] >> y & 1, on);
      }
}

}  // namespace
}  // namespace vdb_diffuse
