#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "grid/volume.h"
#include "reference/random.h"

namespace vdb_diffuse {

/// Where a path is: a block, a voxel in it, and the position from the block's lowest corner in voxels.
///
///      0   1   2   3   4   5   6   7   8        voxel 3 covers 3 <= x <= 4; the corner of the block lies
///      |   |   |   | * |   |   |   |   |        half a voxel below the centre of its first voxel
struct Place {
  int32_t block = kNoBlock;
  std::array<int32_t, 3> voxel{0, 0, 0};
  Vec3f x{0, 0, 0};
};

/// Within a block of records, voxels stand in Morton order, so that the eight of a 2 x 2 x 2 cube are
/// neighbours in memory: a ray that comes from any side finds what it needs next more often at hand. This is
/// one axis' share of a voxel's number there.
constexpr int kOrderOf[3][kBlockWidth] = {
    {0, 4, 32, 36, 256, 260, 288, 292}, {0, 2, 16, 18, 128, 130, 144, 146}, {0, 1, 8, 9, 64, 65, 72, 73}};
inline int recordOffset(int x, int y, int z) {
  return kOrderOf[0][x] + kOrderOf[1][y] + kOrderOf[2][z];
}

/// Walks through the voxels of a density, block by block. Within a block the position counts from the
/// block's corner, so that float is enough however large the volume is, and the next block is a look at a
/// table; only where there is none are blocks searched for, in double. After Amanatides and Woo (1987).
///
/// The walk reads densities from records, one for each voxel, that begin with it; what follows there is the
/// caller's. Lengths are in units of the mean voxel size h; directions are voxels per h.
class VoxelWalk {
 public:
  explicit VoxelWalk(const Topology& topology);

  enum class End { kStopped, kLimit, kLeft };

  /// First voxel of a block on the ray c + t d, t >= 0 and nearer than `limit`; c is in voxels, voxel i
  /// covering i .. i+1. False where there is none; else t is where the ray enters.
  bool enter(const Vec3d& c, const Vec3d& d, double limit, double& t, Place& place) const;

  /// Visits voxel after voxel from `place` on: visit(record, rho, length) -> bool, where `record` counts the
  /// voxels of all blocks, and `length` may be shortened by a visit that returns false to stop there. Ends as
  /// well after `limit`, or where there are no more blocks. `place` and `travelled` follow, except that
  /// nothing is said of the place after kLeft.
  /// \param records   of `kRecord` floats each, the density first
  template <int kRecord, typename Visit>
  End walk(const float* records, Place& place, const Vec3f& d, float limit, float& travelled,
           const Visit& visit) const;

  /// Corner of a block in voxels, as c counts them.
  Vec3d corner(int32_t block) const { return corners_[block]; }

 private:
  const Topology& topology_;
  std::vector<Vec3d> corners_;
  Coord lowest_, highest_;  // blocks

  bool findBlock(Coord block, const Vec3d& c, const Vec3d& d, double limit, double& t, Place& place) const;
  bool crossGap(Place& place, const Vec3f& d, const Coord& next, float limit, float& travelled) const;
};

/// Three numbers and an idle fourth, in one register.
using Lanes = float __attribute__((vector_size(16)));
using IntLanes = int32_t __attribute__((vector_size(16)));

template <int kRecord, typename Visit>
VoxelWalk::End VoxelWalk::walk(const float* records, Place& place, const Vec3f& direction, float limit,
                               float& travelled, const Visit& visit) const {
  // Which axis comes next is a toss-up, and a branch on it costs more than all three in one register. A
  // voxel's number in Morton order has three bits for each axis; v + 1 there is (v - kBits) & kBits.
  constexpr float kNever = std::numeric_limits<float>::infinity();
  constexpr IntLanes kBits{kOrderOf[0][7], kOrderOf[1][7], kOrderOf[2][7], 0};
  constexpr IntLanes kOne{kOrderOf[0][1], kOrderOf[1][1], kOrderOf[2][1], 0};
  const Lanes d{direction[0], direction[1], direction[2], 1};
  const IntLanes up = d > Lanes{};
  const Lanes inverse = 1 / d, step = up ? inverse : -inverse;
  const IntLanes minus = (up & kBits) | (~up & kOne);
  travelled = 0;
  while (true) {  // one block
    const size_t first = static_cast<size_t>(place.block) * kBlockVoxels;
    const IntLanes voxel{place.voxel[0], place.voxel[1], place.voxel[2], 0};
    const Lanes x{place.x[0], place.x[1], place.x[2], 0};
    Lanes next = (__builtin_convertvector(voxel - up, Lanes) - x) * inverse;  // `up` is -1
    next[3] = kNever;
    IntLanes left = up ? kBlockWidth - 1 - voxel : voxel;  // voxels beyond this one in the block
    IntLanes order{kOrderOf[0][voxel[0]], kOrderOf[1][voxel[1]], kOrderOf[2][voxel[2]], 0};
    const float limit_here = limit - travelled;
    float t = 0;
    const auto moveTo = [&](float t_end) {
      travelled += t_end;
      const IntLanes now = up ? kBlockWidth - 1 - left : left;
      for (int a = 0; a < 3; ++a) {
        const float low = static_cast<float>(now[a]);
        place.voxel[a] = now[a];
        place.x[a] = std::min(std::max(place.x[a] + t_end * d[a], low), low + 1);
      }
    };
    while (true) {  // one voxel
      const size_t record = first + static_cast<uint32_t>(order[0] | order[1] | order[2]);
      const Lanes second{next[1], next[2], next[0], next[3]};
      const Lanes third{next[2], next[0], next[1], next[3]};
      const Lanes of_two = next < second ? next : second;
      const Lanes nearest = of_two < third ? of_two : third;
      const float t_exit = std::min(std::max(nearest[0], t), limit_here);
      float length = t_exit - t;
      if (!visit(record, records[record * kRecord], length)) {
        moveTo(t + length);
        return End::kStopped;
      }
      t = t_exit;
      if (t >= limit_here) {
        moveTo(t);
        travelled = limit;
        return End::kLimit;
      }
      const IntLanes crossed = next == nearest;  // two or three where the ray meets an edge
      next += reinterpret_cast<Lanes>(reinterpret_cast<IntLanes>(step) & crossed);
      left += crossed;
      order = (order - (minus & crossed)) & kBits;
      if ((left[0] | left[1] | left[2]) < 0) break;
    }
    const int axis = left[0] < 0 ? 0 : left[1] < 0 ? 1 : 2;
    left = left < 0 ? IntLanes{} : left;
    moveTo(t);
    const bool forward = up[axis] != 0;
    const int32_t neighbour = topology_.neighbours(place.block)[2 * axis + forward];
    if (neighbour != kNoBlock) {
      place.block = neighbour;
      place.voxel[axis] = forward ? 0 : kBlockWidth - 1;
      place.x[axis] = forward ? 0 : kBlockWidth;
      continue;
    }
    Coord across(0, 0, 0);
    across[axis] = forward ? 1 : -1;
    if (!crossGap(place, direction, across, limit, travelled))
      return travelled < limit ? End::kLeft : End::kLimit;
  }
}

}  // namespace vdb_diffuse
