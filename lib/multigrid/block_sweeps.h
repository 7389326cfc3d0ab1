#pragma once

#include "multigrid/braided_block.h"

// What the cycle does to one block while its faces are in the first-level cache.

namespace vdb_diffuse {

enum class SweepOrder { kForward, kBackward };

/// A braided block: faces, values with what lies around them, right-hand side, 1 / A_ii and sink.
struct BlockSystem {
  uint64_t braids;
  BraidedFaces g;
  BraidedHalo u;
  BraidedValues right, inverse, sink;
};

constexpr uint64_t kEvenPlanes = 0x03f03f03f03full;

/// visit(place, strand) for the voxels of one colour.
template <typename Visit>
VDB_DIFFUSE_INLINE void forEachOfColour(uint64_t braids, int colour, const Visit& visit) {
  const uint64_t even = braids & kEvenPlanes, odd = braids & ~kEvenPlanes;
  forEachBraid(colour ? odd : even, [&](int n) VDB_DIFFUSE_INLINED { visit(n, 0); });
  forEachBraid(colour ? even : odd, [&](int n) VDB_DIFFUSE_INLINED { visit(n, 1); });
}

/// Red-black Gauss-Seidel, colour by colour.
VDB_DIFFUSE_INLINE void relax(BlockSystem& s, SweepOrder order, int sweeps) {
  for (int pass = 0; pass < 2 * sweeps; ++pass)
    forEachOfColour(s.braids, (pass & 1) ^ (order == SweepOrder::kBackward ? 1 : 0),
                    [&](int n, int strand) VDB_DIFFUSE_INLINED {
                      storeRow(s.u.at(n, strand),
                               (loadRow(s.right.v[n][strand]) + sumOfNeighbours(s.g, s.u, n, strand)) *
                                   loadRow(s.inverse.v[n][strand]));
                    });
}

/// A u for the voxels of a strand.
VDB_DIFFUSE_INLINE Row applied(const BlockSystem& s, int n, int strand) {
  return sumOfDifferences(s.g, s.u, n, strand) + loadRow(s.sink.v[n][strand]) * loadRow(s.u.at(n, strand));
}

}  // namespace vdb_diffuse
