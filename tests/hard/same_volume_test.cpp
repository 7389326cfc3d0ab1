#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Prune.h>

#include "cli/run_program.h"
#include "io/vdb_reader.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

using openvdb::FloatGrid;

/// One cloud, told in several ways: half a lump of scattered densities, half a body of one density, which can
/// be stored in tiles. What `bake` makes of each differs by ten times the tolerance at the most.
class SameVolume : public ::testing::Test {
 protected:
  static constexpr double kStep = 0.3, kTolerance = 1e-5;
  static constexpr const char* kFlags =
      " --sigma-s 1.5 --sigma-a 0.1 --g 0.4 --sun 0.2,-0.4,-1 --env 0.3 --tolerance 1e-5 --sweeps ";

  static double density(const Coord& p) { return p[0] < 16 ? lumpyDensity(p) : 0.4; }
  /// The cloud's voxels from x = `from` to less than `to`, `moved` in the grid.
  static FloatGrid::Ptr cloud(const Coord& moved = Coord(0), int from = 0, int to = 40) {
    openvdb::initialize();
    auto grid = FloatGrid::create();
    grid->setName("density");
    grid->setTransform(openvdb::math::Transform::createLinearTransform(kStep));
    auto accessor = grid->getAccessor();
    for (int x = from; x < to; ++x)
      for (int y = 0; y < 24; ++y)
        for (int z = 0; z < 24; ++z)
          if (const double rho = density(Coord(x, y, z)); rho >= 0)
            accessor.setValueOn(moved + Coord(x, y, z), static_cast<float>(rho));
    return grid;
  }
  std::string write(const std::string& name, const FloatGrid::Ptr& grid) const {
    openvdb::io::File(folder_.file(name)).write({grid});
    return folder_.file(name) + " ";
  }
  /// The lit volume of these files.
  std::string lit(const std::string& files, const std::string& sweeps, const std::string& name) const {
    const Outcome outcome = runProgram("bake " + files + "-o " + folder_.file(name) + kFlags + sweeps);
    EXPECT_EQ(outcome.status, 0) << outcome.error;
    return folder_.file(name);
  }
  static void expectSame(const std::string& a, const std::string& b, const Coord& moved,
                         const std::string& what) {
    for (const char* name : {"density", "diffuse", "direct"}) {
      const GridValues of_a = VdbFile(a).readValues(name), of_b = VdbFile(b).readValues(name);
      EXPECT_LE(largestDifference(*of_a.topology, of_a.channels.at(0), *of_b.topology, of_b.channels.at(0),
                                  [&](Coord p) { return p + moved; }),
                10 * kTolerance)
          << name << ", " << what;
    }
  }
  const TemporaryFolder folder_;
};

TEST_F(SameVolume, ToldInTilesOrElsewhereInTheGridOrInTwoFiles) {
  const auto pruned = cloud();
  openvdb::tools::prune(pruned->tree());
  ASSERT_GE(pruned->tree().activeTileCount(), 20u);
  const std::string plain = write("plain.vdb", cloud()), tiles = write("tiles.vdb", pruned),
                    parts = write("left.vdb", cloud(Coord(0), 0, 21)) +
                            write("right.vdb", cloud(Coord(0), 21, 40));
  for (const std::string sweeps : {"0", "2"}) {
    const std::string expected = lit(plain, sweeps, "expected.vdb"), what = sweeps + " sweeps, ";
    expectSame(expected, lit(tiles, sweeps, "lit.vdb"), Coord(0), what + "in tiles");
    expectSame(expected, lit(parts, sweeps, "lit.vdb"), Coord(0), what + "in two files");
    for (const Coord& moved : {Coord(8, -16, 24), Coord(1, 0, 0), Coord(-3, 2, 5)})
      expectSame(expected, lit(write("moved.vdb", cloud(moved)), sweeps, "lit.vdb"), moved,
                 what + "moved by " + std::to_string(moved[0]));
  }
}

}  // namespace
}  // namespace vdb_diffuse
