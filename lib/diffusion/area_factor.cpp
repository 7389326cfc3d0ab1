#include "diffusion/area_factor.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace vdb_diffuse {
namespace {

constexpr int kRadius = 3;
constexpr int kSpan = kBlockWidth + 2 * kRadius;

/// Active voxels of a block and kRadius layers around it: bit z + kRadius of row[x + kRadius][y + kRadius].
struct BitHalo {
  uint32_t row[kSpan][kSpan] = {};

  BitHalo(const Topology& topology, size_t block) {
    const Coord& origin = topology.origin(block);
    for (int bx = -1; bx <= 1; ++bx)
      for (int by = -1; by <= 1; ++by)
        for (int bz = -1; bz <= 1; ++bz) {
          const Coord at = origin + Coord(8 * bx, 8 * by, 8 * bz);
          const int32_t b = bx || by || bz ? topology.find(at) : static_cast<int32_t>(block);
          if (b == kNoBlock) continue;
          const BlockMask& mask = topology.active(b);
          for (int x = std::max(0, 8 * bx + kRadius); x < std::min(kSpan, 8 * bx + kRadius + 8); ++x)
            for (int y = std::max(0, 8 * by + kRadius); y < std::min(kSpan, 8 * by + kRadius + 8); ++y) {
              const uint32_t bits =
                  mask.getWord<uint8_t>((x - kRadius - 8 * bx) * 8 + (y - kRadius - 8 * by));
              const int shift = 8 * bz + kRadius;
              row[x][y] |= shift >= 0 ? bits << shift : bits >> -shift;
            }
        }
  }
};

/// How many bits are set among the 2 kRadius + 1 of a ball's row, and the sum of their offsets from the
/// middle.
struct RowMoments {
  std::array<int8_t, 1 << (2 * kRadius + 1)> count, moment;
  RowMoments() {
    for (int bits = 0; bits < static_cast<int>(count.size()); ++bits) {
      count[bits] = moment[bits] = 0;
      for (int i = 0; i <= 2 * kRadius; ++i)
        if (bits >> i & 1) {
          ++count[bits];
          moment[bits] = static_cast<int8_t>(moment[bits] + i - kRadius);
        }
    }
  }
};

struct BallRow {
  int dx, dy;
  uint32_t mask;  // the ball's extent along z
};

std::array<BallRow, 29> ballRows() {
  std::array<BallRow, 29> rows{};
  size_t n = 0;
  for (int dx = -kRadius; dx <= kRadius; ++dx)
    for (int dy = -kRadius; dy <= kRadius; ++dy) {
      const int left = kRadius * kRadius - dx * dx - dy * dy;
      if (left < 0) continue;
      const int reach = static_cast<int>(std::sqrt(static_cast<double>(left)));
      uint32_t mask = 0;
      for (int dz = -reach; dz <= reach; ++dz) mask |= 1u << (dz + kRadius);
      rows[n++] = {dx, dy, mask};
    }
  return rows;
}

// A ball that is empty beyond its middle layer has a moment of 70 voxels; below this the mask is as good as
// symmetric about the voxel and names no direction.
constexpr double kLeastMoment = 2;

}  // namespace

void areaFactors(const Topology& topology, const Vec3d& voxel_size, size_t block, float* a) {
  static const RowMoments moments;
  static const std::array<BallRow, 29> ball = ballRows();
  std::fill_n(a, kBlockVoxels, 1.0f);
  const BitHalo bits(topology, block);
  const double h = std::cbrt(voxel_size[0] * voxel_size[1] * voxel_size[2]);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      const uint32_t(*row)[kSpan] = bits.row + x;  // row[kRadius + dx][y + kRadius + dy]
      const uint32_t own = row[kRadius][y + kRadius];
      const uint32_t enclosed = row[kRadius - 1][y + kRadius] & row[kRadius + 1][y + kRadius] &
                                row[kRadius][y + kRadius - 1] & row[kRadius][y + kRadius + 1] & (own << 1) &
                                (own >> 1);
      uint32_t open = (own & ~enclosed) >> kRadius & 0xff;
      for (; open; open &= open - 1) {
        const int z = __builtin_ctz(open);
        int mx = 0, my = 0, mz = 0;
        for (const BallRow& r : ball) {
          const uint32_t seen = row[kRadius + r.dx][y + kRadius + r.dy] >> z & r.mask;
          mx += r.dx * moments.count[seen];
          my += r.dy * moments.count[seen];
          mz += moments.moment[seen];
        }
        if (mx * mx + my * my + mz * mz < kLeastMoment * kLeastMoment) continue;
        const double nx = std::abs(mx) * h / voxel_size[0], ny = std::abs(my) * h / voxel_size[1],
                     nz = std::abs(mz) * h / voxel_size[2];
        a[voxelOffset(x, y, z)] = static_cast<float>(std::sqrt(nx * nx + ny * ny + nz * nz) / (nx + ny + nz));
      }
    }
}

}  // namespace vdb_diffuse
