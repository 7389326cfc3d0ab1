#pragma once

#include <limits>

#include "multigrid/block_kernel.h"

// A block as its sweeps see it: rows y and y+1 braided into two strands,
//
//     row y      a0 a1 a2 a3 a4 a5 a6 a7         strand 0   a0 b1 a2 b3 a4 b5 a6 b7
//     row y+1    b0 b1 b2 b3 b4 b5 b6 b7         strand 1   b0 a1 b2 a3 b4 a5 b6 a7
//
// so that each strand holds voxels of one colour of a checkerboard in x + y + z, and no lane of a register is
// wasted when one colour is relaxed. All neighbours of a strand's voxels stand in the lane they are wanted
// in:
//
//     along x          the same strand of the next plane
//     in the braid     the other strand
//     along y, out     the other strand of the braids on either side, lanes of one and of the other in turn
//     along z          the other strand, one lane on
//
// A braid is a cache line of a block, and two by two of them side by side along x are four coarse voxels.

namespace vdb_diffuse {

constexpr int kBraids = 4;                       ///< of two rows each, along y
constexpr int kNextX = kBraids + 2, kNextY = 1;  ///< steps from braid to braid, with one around them along y
constexpr int kPlaces = 8 * kNextX;

/// A braid's place in all that is kept of a block while it is worked on.
VDB_DIFFUSE_INLINE int placeOf(int x, int q) {
  return x * kNextX + q;
}

/// Lanes with even z from one row, those with odd z from the other. Undoes itself.
VDB_DIFFUSE_INLINE Row alternate(Row even, Row odd) {
  constexpr RowMask kOdd = {0, -1, 0, -1, 0, -1, 0, -1};
  return kOdd ? odd : even;
}

struct Braid {
  Row strand[2];
};
VDB_DIFFUSE_INLINE Braid braid(Row a, Row b) {
  return {{alternate(a, b), alternate(b, a)}};
}
VDB_DIFFUSE_INLINE Braid loadBraid(const float* rows) {
  return braid(loadRow(rows), loadRow(rows + 8));
}
VDB_DIFFUSE_INLINE void storeBraid(float* rows, const Braid& v) {
  storeRow(rows, alternate(v.strand[0], v.strand[1]));
  storeRow(rows + 8, alternate(v.strand[1], v.strand[0]));
}
/// Offset of a braid in its block.
VDB_DIFFUSE_INLINE int braidOffset(int x, int q) {
  return x * 64 + q * 16;
}

/// A block's values and the six layers around it, braided.
struct alignas(64) BraidedHalo {
  float v[kPlaces + 2 * kNextX][2][8];
  float below[kPlaces][2], above[kPlaces][2];  ///< next to the strands' ends
  float* at(int place, int s) { return v[place + kNextX + kNextY][s]; }
  const float* at(int place, int s) const { return v[place + kNextX + kNextY][s]; }
};

/// What lies next to a strand's voxels.
struct StrandNeighbours {
  Row x_low, x_high, inner, outer, below, above;
};
VDB_DIFFUSE_INLINE StrandNeighbours neighboursOf(const BraidedHalo& u, int n, int s) {
  const Row other = loadRow(u.at(n, 1 - s));
  const Row low = loadRow(u.at(n - kNextY, 1 - s)), high = loadRow(u.at(n + kNextY, 1 - s));
  return {loadRow(u.at(n - kNextX, s)),
          loadRow(u.at(n + kNextX, s)),
          other,
          s == 0 ? alternate(low, high) : alternate(high, low),
          shiftedUp(other, u.below[n][s]),
          shiftedDown(other, u.above[n][s])};
}

VDB_DIFFUSE_INLINE void clear(BraidedHalo& halo) {
  clearRows(&halo.v[0][0][0], static_cast<int>(sizeof(halo) / sizeof(Row)));
}

/// The six layers around the block.
VDB_DIFFUSE_INLINE void loadLayers(const Topology& topology, const Field<float>& field, size_t b,
                                   float outside, BraidedHalo& halo) {
  const std::array<int32_t, 6>& near = topology.neighbours(b);
  const auto block = [&](int face) VDB_DIFFUSE_INLINED {
    return near[face] == kNoBlock ? nullptr : field.block(near[face]);
  };
  const Row nothing = outside - Row{};
  for (int up = 0; up < 2; ++up) {
    const float* n = block(up ? Topology::kPlusX : Topology::kMinusX);
    for (int q = 0; q < kBraids; ++q) {
      const Braid v = n ? loadBraid(n + braidOffset(up ? 0 : 7, q)) : Braid{{nothing, nothing}};
      for (int s = 0; s < 2; ++s) storeRow(halo.at(placeOf(up ? 8 : -1, q), s), v.strand[s]);
    }
  }
  for (int up = 0; up < 2; ++up) {
    const float* n = block(up ? Topology::kPlusY : Topology::kMinusY);
    for (int x = 0; x < 8; ++x) {
      const Row v = n ? loadRow(n + voxelOffset(x, up ? 0 : 7, 0)) : nothing;
      for (int s = 0; s < 2; ++s) storeRow(halo.at(placeOf(x, up ? kBraids : -1), s), v);
    }
  }
  const float *below = block(Topology::kMinusZ), *above = block(Topology::kPlusZ);
  for (int x = 0; x < 8; ++x)
    for (int q = 0; q < kBraids; ++q)
      for (int s = 0; s < 2; ++s) {  // strand 0 begins in the first row and ends in the second
        const int n = placeOf(x, q);
        halo.below[n][s] = below ? below[voxelOffset(x, 2 * q + s, 7)] : outside;
        halo.above[n][s] = above ? above[voxelOffset(x, 2 * q + 1 - s, 0)] : outside;
      }
}

VDB_DIFFUSE_INLINE void loadOwn(const float* block, BraidedHalo& halo) {
  for (int x = 0; x < 8; ++x)
    for (int q = 0; q < kBraids; ++q) {
      const Braid v = loadBraid(block + braidOffset(x, q));
      for (int s = 0; s < 2; ++s) storeRow(halo.at(placeOf(x, q), s), v.strand[s]);
    }
}
VDB_DIFFUSE_INLINE void clearOwn(BraidedHalo& halo) {
  for (int x = 0; x < 8; ++x) clearRows(halo.at(placeOf(x, 0), 0), 2 * kBraids);
}
VDB_DIFFUSE_INLINE void storeOwn(const BraidedHalo& halo, float* block) {
  for (int x = 0; x < 8; ++x)
    for (int q = 0; q < kBraids; ++q) {
      const int n = placeOf(x, q);
      storeBraid(block + braidOffset(x, q), {{loadRow(halo.at(n, 0)), loadRow(halo.at(n, 1))}});
    }
}

/// Values of a block that are needed without their neighbours.
struct alignas(64) BraidedValues {
  float v[kPlaces][2][8];
};
VDB_DIFFUSE_INLINE void loadValues(const float* block, BraidedValues& values) {
  for (int x = 0; x < 8; ++x)
    for (int q = 0; q < kBraids; ++q) {
      const Braid v = loadBraid(block + braidOffset(x, q));
      for (int s = 0; s < 2; ++s) storeRow(values.v[placeOf(x, q)][s], v.strand[s]);
    }
}

/// Conductances of all faces of a block's voxels, by the place of their braids; x: of the faces below.
struct alignas(64) BraidedFaces {
  float x[kPlaces + kNextX][2][8];
  float inner[kPlaces][8];  ///< between the rows of a braid
  float outer[kPlaces][2][8], below[kPlaces][2][8], above[kPlaces][2][8];
};

/// Places of the braids that have an active voxel, a bit each.
VDB_DIFFUSE_INLINE uint64_t activeBraids(const BlockMask& mask) {
  uint64_t braids = 0;
  for (int x = 0; x < 8; ++x) {
    const uint64_t rows = mask.getWord<uint64_t>(x);
    for (int q = 0; q < kBraids; ++q) braids |= uint64_t{(rows >> 16 * q & 0xffff) != 0} << placeOf(x, q);
  }
  return braids;
}

/// visit(place) for all braids of a set.
template <typename Visit>
VDB_DIFFUSE_INLINE void forEachBraid(uint64_t braids, const Visit& visit) {
  for (; braids; braids &= braids - 1) visit(__builtin_ctzll(braids));
}

/// 1 / d but for its last bit, and 0 for infinity: an estimate and a step of Newton's method, which take half
/// of the time of a division.
VDB_DIFFUSE_INLINE Row inverseOf(Row d) {
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
  const Row finite = std::numeric_limits<float>::max() - Row{};  // whose estimate is 0, as for infinity
  d = d < finite ? d : finite;
  const Row y = __builtin_shufflevector(__builtin_ia32_rcpps(__builtin_shufflevector(d, d, 0, 1, 2, 3)),
                                        __builtin_ia32_rcpps(__builtin_shufflevector(d, d, 4, 5, 6, 7)), 0, 1,
                                        2, 3, 4, 5, 6, 7);
  return y * (2 - d * y);
#else
  return 1 / d;
#endif
}

/// Faces of the finest level, from its half resistances. Either side of a face forms the same number.
VDB_DIFFUSE_INLINE void formFaces(const Operator& A, size_t b, uint64_t braids, BraidedFaces& g) {
  BraidedHalo r;
  loadOwn(A.half_resistance.block(b), r);
  loadLayers(*A.topology, A.half_resistance, b, std::numeric_limits<float>::infinity(), r);
  const auto conductance = [&](int axis, Row a, Row c)
                               VDB_DIFFUSE_INLINED { return A.scale[axis] * inverseOf(a + c); };
  forEachBraid(braids | braids << kNextX, [&](int n) VDB_DIFFUSE_INLINED {
    for (int s = 0; s < 2; ++s)
      storeRow(g.x[n][s], conductance(0, loadRow(r.at(n - kNextX, s)), loadRow(r.at(n, s))));
  });
  forEachBraid(braids, [&](int n) VDB_DIFFUSE_INLINED {
    storeRow(g.inner[n], conductance(1, loadRow(r.at(n, 0)), loadRow(r.at(n, 1))));
    for (int s = 0; s < 2; ++s) {
      const Row own = loadRow(r.at(n, s));
      const StrandNeighbours next = neighboursOf(r, n, s);
      storeRow(g.outer[n][s], conductance(1, own, next.outer));
      storeRow(g.below[n][s], conductance(2, own, next.below));
      storeRow(g.above[n][s], conductance(2, own, next.above));
    }
  });
}

VDB_DIFFUSE_INLINE void cutFaces(const CutFaces& cuts, BraidedFaces& g) {
  for (int face = 0; face < 6; ++face)
    for (auto it = cuts.cut[face].beginOn(); it; ++it) {
      const Coord p = voxelLocal(it.pos());
      const int n = placeOf(p[0], p[1] >> 1), z = p[2], s = (p[1] ^ z) & 1, up = face % 2;
      if (face / 2 == 0)
        g.x[up ? n + kNextX : n][s][z] = 0;
      else if (face / 2 == 2)
        (up ? g.above : g.below)[n][s][z] = 0;
      else if ((p[1] & 1) == up)
        g.outer[n][s][z] = 0;
      else
        g.inner[n][z] = 0;
    }
}

/// Coarse levels keep their faces.
VDB_DIFFUSE_INLINE void copyFaces(const Operator& A, size_t b, BraidedFaces& g) {
  const std::array<int32_t, 6>& near = A.topology->neighbours(b);
  const auto next = [&](int axis) VDB_DIFFUSE_INLINED -> const float* {
    const int32_t n = near[2 * axis + 1];
    return n == kNoBlock ? nullptr : A.faces[axis].block(n);
  };
  const float *fx = A.faces[0].block(b), *fy = A.faces[1].block(b), *fz = A.faces[2].block(b);
  const float *right = next(0), *back = next(1), *top = next(2);
  const Row zero = {};
  for (int x = 0; x < 9; ++x)
    for (int q = 0; q < kBraids; ++q) {
      const Braid v = x < 8   ? loadBraid(fx + braidOffset(x, q))
                      : right ? loadBraid(right + braidOffset(0, q))
                              : Braid{{zero, zero}};
      for (int s = 0; s < 2; ++s) storeRow(g.x[placeOf(x, q)][s], v.strand[s]);
    }
  for (int x = 0; x < 8; ++x)
    for (int q = 0; q < kBraids; ++q) {
      const int at = braidOffset(x, q), n = placeOf(x, q);
      storeRow(g.inner[n], loadRow(fy + at + 8));
      const Row low = loadRow(fy + at);
      const Row high = q < kBraids - 1 ? loadRow(fy + at + 16) : back ? loadRow(back + x * 64) : zero;
      storeRow(g.outer[n][0], alternate(low, high));
      storeRow(g.outer[n][1], alternate(high, low));
      const Braid below = loadBraid(fz + at);
      for (int s = 0; s < 2; ++s) {
        storeRow(g.below[n][s], below.strand[s]);
        storeRow(g.above[n][s],
                 shiftedDown(below.strand[1 - s], top ? top[voxelOffset(x, 2 * q + 1 - s, 0)] : 0.0f));
      }
    }
}

/// Faces of the given braids; those of the finest level are formed from their half resistances.
VDB_DIFFUSE_INLINE void loadFaces(const Operator& A, size_t b, uint64_t braids, BraidedFaces& g) {
  if (!A.finest()) return copyFaces(A, b, g);
  formFaces(A, b, braids, g);
  if (A.cuts.empty()) return;
  const auto found = A.cuts.find(static_cast<int32_t>(b));
  if (found != A.cuts.end()) cutFaces(found->second, g);
}

/// Sum over faces of g x_j for the voxels of a strand.
VDB_DIFFUSE_INLINE Row sumOfNeighbours(const BraidedFaces& g, const BraidedHalo& u, int n, int s) {
  const StrandNeighbours next = neighboursOf(u, n, s);
  return (loadRow(g.x[n][s]) * next.x_low + loadRow(g.x[n + kNextX][s]) * next.x_high) +
         (loadRow(g.inner[n]) * next.inner + loadRow(g.outer[n][s]) * next.outer) +
         (loadRow(g.below[n][s]) * next.below + loadRow(g.above[n][s]) * next.above);
}

/// Sum over faces of g (x_i - x_j) for the voxels of a strand.
VDB_DIFFUSE_INLINE Row sumOfDifferences(const BraidedFaces& g, const BraidedHalo& u, int n, int s) {
  const Row c = loadRow(u.at(n, s));
  const StrandNeighbours next = neighboursOf(u, n, s);
  return (loadRow(g.x[n][s]) * (c - next.x_low) + loadRow(g.x[n + kNextX][s]) * (c - next.x_high)) +
         (loadRow(g.inner[n]) * (c - next.inner) + loadRow(g.outer[n][s]) * (c - next.outer)) +
         (loadRow(g.below[n][s]) * (c - next.below) + loadRow(g.above[n][s]) * (c - next.above));
}

}  // namespace vdb_diffuse
