#pragma once

#include <algorithm>

#include "grid/row.h"

namespace vdb_diffuse {

// Kernels work on rows of eight voxels along memory. For rays that are nearest to z a row runs along y
// instead: such a block is transposed first, [x][y][z] to [z][x][y].

inline void turnBlock(const float* from, float* to) {
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z) to[z * 64 + x * 8 + y] = from[x * 64 + y * 8 + z];
}

inline void addTurnedBack(const float* from, float* to) {
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z) to[x * 64 + y * 8 + z] += from[z * 64 + x * 8 + y];
}

/// The same for a mask, a byte for each row; as it is and turned.
struct RowBits {
  uint8_t plain[64], turned[64];
  explicit RowBits(const BlockMask& mask) {
    std::copy_n(rowBits(mask), 64, plain);
    std::fill_n(turned, 64, uint8_t{0});
    for (auto it = mask.beginOn(); it; ++it) {
      const Coord p = voxelLocal(static_cast<int>(it.pos()));
      turned[p[2] * 8 + p[0]] |= static_cast<uint8_t>(1 << p[1]);
    }
  }
};

VDB_DIFFUSE_INLINE bool anyAbove0(Row row) {
  uint64_t words[4];
  __builtin_memcpy(words, &row, sizeof words);
  return (words[0] | words[1] | words[2] | words[3]) != 0;
}

}  // namespace vdb_diffuse
