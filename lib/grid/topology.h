#pragma once

#include <openvdb/math/Coord.h>
#include <openvdb/util/NodeMasks.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "grid/aligned.h"

namespace vdb_diffuse {

using openvdb::Coord;

/// Voxels are stored in blocks of 8 x 8 x 8, the size of an OpenVDB leaf; a voxel's place in its block is
/// x*64 + y*8 + z, OpenVDB's own order, so that z runs along memory.
constexpr int kBlockWidth = 8;
constexpr int kBlockVoxels = 512;
constexpr int32_t kNoBlock = -1;

using BlockMask = openvdb::util::NodeMask<3>;

inline int voxelOffset(int x, int y, int z) {
  return (x << 6) | (y << 3) | z;
}
inline Coord voxelLocal(int n) {
  return Coord(n >> 6, (n >> 3) & 7, n & 7);
}
inline Coord blockOriginOf(const Coord& p_index) {
  return p_index & ~(kBlockWidth - 1);
}

/// Which voxels are active: the leaves of a VDB, frozen into flat arrays. Blocks stand in Morton order, so
/// the order depends on the coordinates alone, neighbours in space are near in memory, and a coarse block's
/// children are consecutive.
class Topology {
 public:
  enum Face { kMinusX, kPlusX, kMinusY, kPlusY, kMinusZ, kPlusZ };

  Topology() = default;
  /// \param origins  lowest corner of each block, in voxels, multiples of 8, each once, in any order
  /// \param active   active voxels of each block, in the order of `origins`; blocks without any are dropped
  Topology(std::vector<Coord> origins, std::vector<BlockMask> active);

  size_t blockCount() const { return origins_.size(); }
  size_t activeVoxelCount() const { return active_voxels_; }
  const Coord& origin(size_t block) const { return origins_[block]; }
  const BlockMask& active(size_t block) const { return active_[block]; }
  /// Blocks across the six faces, in the order of `Face`; kNoBlock where there is none.
  const std::array<int32_t, 6>& neighbours(size_t block) const { return neighbours_[block]; }
  /// Block whose lowest corner is `origin` (a multiple of 8), or kNoBlock.
  int32_t find(const Coord& origin) const;
  bool isActive(const Coord& p_index) const;
  /// Active voxels of a block whose neighbour across each face is not active, in the order of `Face`.
  std::array<BlockMask, 6> outerFaces(size_t block) const;
  /// Lowest and highest corner of all blocks, both inclusive, in voxels. Only for a topology with blocks.
  const Coord& lowest() const { return lowest_; }
  const Coord& highest() const { return highest_; }
  size_t bytes() const;
  /// The same of the active voxels.
  std::pair<Coord, Coord> activeBox() const;

 private:
  std::vector<Coord> origins_;
  std::vector<BlockMask> active_;
  std::vector<std::array<int32_t, 6>> neighbours_;
  std::vector<int32_t> table_;  // a dense table over the bounding box where that is small, else a hash table
  bool dense_ = false;
  Coord lowest_{0, 0, 0}, highest_{-1, -1, -1}, table_size_{0, 0, 0};
  size_t active_voxels_ = 0;

  size_t hashSlot(const Coord& origin) const;
};

}  // namespace vdb_diffuse
