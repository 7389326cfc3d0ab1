#include "medium/wavefront.h"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>

#include "grid/error.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

/// A lump with a hole and gaps between its blocks.
Medium holed() {
  return boxMedium(
      Coord(60, 50, 40), Transform(),
      [](Coord p) {
        const bool hole = p[0] / 8 == 3 && p[1] / 8 > 1, gap = p[2] / 8 == 2 && p[0] / 8 % 2;
        return hole || gap ? -1.0 : 1.0;
      },
      Coord(-13, 5, -40));
}

TEST(Wavefront, PassesEveryBlockOnceAndNoneBeforeThoseUpstream) {
  const Medium medium = holed();
  const Topology& topology = medium.topology();
  const Wavefront wavefront(medium.density.topology, Vec3d(1), offPlanes());
  for (int octant = 0; octant < Wavefront::kOctants; ++octant) {
    std::vector<std::atomic<int>> visits(topology.blockCount());
    std::atomic<int> early{0};
    wavefront.pass(octant, [&](size_t b, Wavefront::Rays&) {
      // Any block that a ray of this octant can have passed on its way lies upstream along each axis.
      for (size_t other = 0; other < topology.blockCount(); ++other) {
        bool upstream = other != b;
        for (int a = 0; a < 3; ++a) {
          const int ahead = topology.origin(b)[a] - topology.origin(other)[a];
          upstream = upstream && (octant & (4 >> a) ? ahead <= 0 : ahead >= 0);
        }
        if (upstream && visits[other] == 0) ++early;
      }
      ++visits[b];
    });
    EXPECT_EQ(early, 0) << "octant " << octant;
    for (size_t b = 0; b < topology.blockCount(); ++b) EXPECT_EQ(visits[b], 1);
    for (const RayLattice& lattice : wavefront.lattices(octant))
      for (int a = 0; a < 3; ++a) EXPECT_EQ(lattice.s[a] < 0, (octant & (4 >> a)) != 0);
  }
}

TEST(Wavefront, RaysStartDarkAndKeepWhatTheyAreGiven) {
  const Medium medium = holed();
  const Wavefront wavefront(medium.density.topology, Vec3d(1), offPlanes());
  for (int octant = 0; octant < Wavefront::kOctants; ++octant)
    for (int round = 0; round < 2; ++round) {
      std::mutex one_at_a_time;
      const Wavefront::Rays left = wavefront.pass(octant, [&](size_t, Wavefront::Rays& rays) {
        const std::lock_guard<std::mutex> lock(one_at_a_time);
        for (AlignedArray<float>& plane : rays) plane[1] += 1;
      });
      ASSERT_EQ(left.size(), wavefront.lattices(octant).size());
      for (size_t d = 0; d < left.size(); ++d) {
        EXPECT_EQ(left[d][0], 0);
        EXPECT_EQ(left[d][1], static_cast<float>(medium.topology().blockCount()));
      }
    }
}

TEST(Wavefront, RefusesABoxTooWideAndTakesAnEmptyOne) {
  const auto two =
      std::make_shared<const Topology>(std::vector<Coord>{Coord(0, 0, 0), Coord(1 << 20, 1 << 20, 0)},
                                       std::vector<BlockMask>(2, BlockMask(true)));
  EXPECT_THROW(Wavefront(two, Vec3d(1), halfRangeSet(96)), InputError);
  const Wavefront empty(std::make_shared<const Topology>(), Vec3d(1), halfRangeSet(96));
  const Wavefront::Rays rays = empty.pass(0, [](size_t, Wavefront::Rays&) { FAIL(); });
  EXPECT_TRUE(rays.empty());
}

}  // namespace
}  // namespace vdb_diffuse
