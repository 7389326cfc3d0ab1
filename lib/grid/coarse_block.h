#pragma once

#include "grid/topology.h"

// Blocks in voxels of twice the width: eight blocks, one for each octant, make one.

namespace vdb_diffuse {

/// Lowest voxel, in its coarse block, of the octant that a block fills.
inline Coord octantOf(const Coord& fine_origin) {
  return Coord((fine_origin[0] >> 1) & 4, (fine_origin[1] >> 1) & 4, (fine_origin[2] >> 1) & 4);
}

/// Origin of the coarse block, in coarse voxels.
inline Coord coarseOriginOf(const Coord& fine_origin) {
  return blockOriginOf(Coord(fine_origin[0] >> 1, fine_origin[1] >> 1, fine_origin[2] >> 1));
}

/// A slice of a mask, y in its bytes and z in its bits, at half the resolution: the low four bits of four
/// bytes.
inline uint64_t halvedSlice(uint64_t slice) {
  slice |= slice >> 8;
  slice |= slice >> 1;
  uint64_t half = 0;
  for (int j = 0; j < 4; ++j) {
    uint64_t row = slice >> (16 * j) & 0x55;  // every other bit
    row = (row | row >> 1) & 0x33;
    row = (row | row >> 2) & 0x0f;
    half |= row << (8 * j);
  }
  return half;
}

/// Activates in an octant of the coarse mask what has an active child.
inline void coarsenMask(const BlockMask& fine, const Coord& octant, BlockMask& coarse) {
  for (int i = 0; i < 4; ++i)
    coarse.getWord<uint64_t>(octant[0] + i) |=
        halvedSlice(fine.getWord<uint64_t>(2 * i) | fine.getWord<uint64_t>(2 * i + 1))
        << (8 * octant[1] + octant[2]);
}

}  // namespace vdb_diffuse
