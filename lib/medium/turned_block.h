#pragma once

#include <algorithm>

#include "grid/row.h"

namespace vdb_diffuse {

// Kernels work on rows of eight voxels along memory. For rays that are nearest to z a row runs along y
// instead: such a block is transposed first, [x][y][z] to [z][x][y].

void turnBlock(const float* from, float* to);
void turnBack(const float* from, float* to);
void addTurnedBack(const float* from, float* to);

/// The same for a mask, a byte for each row; as it is and turned.
struct RowBits {
  uint8_t plain[64], turned[64];
  explicit RowBits(const BlockMask& mask);
};

VDB_DIFFUSE_INLINE bool anyAbove0(Row row) {
  return anyOf(reinterpret_cast<RowMask>(row));
}

}  // namespace vdb_diffuse
