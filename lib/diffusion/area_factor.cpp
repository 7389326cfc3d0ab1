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

/// Three sums in one number, each within -512..511.
uint32_t packed(int x, int y, int z) {
  return static_cast<uint32_t>(x) + (static_cast<uint32_t>(y) << 10) + (static_cast<uint32_t>(z) << 20);
}
int unpacked(uint32_t sums, int axis) {
  return static_cast<int>((sums + packed(512, 512, 512)) >> 10 * axis & 1023) - 512;
}

/// A row of the ball along z, with the sums of the offsets from the ball's middle of the voxels in it that
/// are active, by the row's 2 kRadius + 1 bits.
struct BallRow {
  int dx = 0, dy = 0;
  std::array<uint32_t, 1 << (2 * kRadius + 1)> moment{};
};

std::array<BallRow, 29> ballRows() {
  std::array<BallRow, 29> rows{};
  size_t n = 0;
  for (int dx = -kRadius; dx <= kRadius; ++dx)
    for (int dy = -kRadius; dy <= kRadius; ++dy) {
      if (dx * dx + dy * dy > kRadius * kRadius) continue;
      BallRow& row = rows[n++];
      row.dx = dx;
      row.dy = dy;
      for (uint32_t bits = 0; bits < row.moment.size(); ++bits)
        for (int dz = -kRadius; dz <= kRadius; ++dz)
          if (bits >> (dz + kRadius) & 1 && dx * dx + dy * dy + dz * dz <= kRadius * kRadius)
            row.moment[bits] += packed(dx, dy, dz);
    }
  return rows;
}

// A ball that is empty beyond its middle layer has a moment of 70 voxels; below this the mask is as good as
// symmetric about the voxel and names no direction.
constexpr double kLeastMoment = 2;

}  // namespace

void areaFactors(const Topology& topology, const Vec3d& voxel_size, size_t block, float* a) {
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
        uint32_t sums = 0;
        for (const BallRow& r : ball)
          sums += r.moment[row[kRadius + r.dx][y + kRadius + r.dy] >> z & (r.moment.size() - 1)];
        const int mx = unpacked(sums, 0), my = unpacked(sums, 1), mz = unpacked(sums, 2);
        if (mx * mx + my * my + mz * mz < kLeastMoment * kLeastMoment) continue;
        const double nx = std::abs(mx) * h / voxel_size[0], ny = std::abs(my) * h / voxel_size[1],
                     nz = std::abs(mz) * h / voxel_size[2];
        a[voxelOffset(x, y, z)] = static_cast<float>(std::sqrt(nx * nx + ny * ny + nz * nz) / (nx + ny + nz));
      }
    }
}

}  // namespace vdb_diffuse
