#pragma once

#include <gtest/gtest.h>

#include "cli/run_program.h"
#include "io/vdb_writer.h"
#include "volumes.h"

namespace vdb_diffuse {

/// A lump of 12 x 12 x 12 voxels of side 0.25, and files of it in a folder of the test's own.
class LumpFiles : public ::testing::Test {
 protected:
  static Medium lump(const Coord& offset = Coord(0), uint64_t seed = 0) {
    return boxMedium(
        Coord(12), Transform::uniform(0.25), [&](Coord p) { return lumpyDensity(p, seed); }, offset);
  }
  std::string out(const std::string& name) const { return " -o " + folder_.file(name) + " "; }
  GridValues grid(const std::string& file, const std::string& name) {
    return VdbFile(folder_.file(file)).readValues(name);
  }
  /// Largest difference over the largest value; both hold the same voxels.
  static void expectSame(const GridValues& a, const GridValues& b, double tolerance) {
    ASSERT_EQ(a.topology->activeVoxelCount(), b.topology->activeVoxelCount());
    ASSERT_EQ(a.channels.size(), b.channels.size());
    for (size_t c = 0; c < a.channels.size(); ++c)
      EXPECT_LT(largestDifference(*a.topology, a.channels[c], *b.topology, b.channels[c],
                                  [](Coord p) { return p; }),
                tolerance)
          << c;
  }
  TemporaryFolder folder_;
};

}  // namespace vdb_diffuse
