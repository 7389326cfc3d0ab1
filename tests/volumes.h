#pragma once

#include <cmath>
#include <functional>

#include "medium/medium.h"

namespace vdb_diffuse {

/// A medium whose density is rho(i,j,k) over the box 0 <= (i,j,k) < size, moved by `offset`; voxels where rho
/// returns a negative number are not active.
inline Medium boxMedium(const Coord& size, const Transform& transform,
                        const std::function<double(Coord)>& rho, const Coord& offset = Coord(0, 0, 0)) {
  std::vector<Coord> origins;
  std::vector<BlockMask> masks;
  const Coord low = blockOriginOf(offset), high = offset + size;
  for (int x = low[0]; x < high[0]; x += 8)
    for (int y = low[1]; y < high[1]; y += 8)
      for (int z = low[2]; z < high[2]; z += 8) {
        BlockMask mask;
        for (int n = 0; n < kBlockVoxels; ++n) {
          const Coord p = Coord(x, y, z) + voxelLocal(n) - offset;
          if (p[0] >= 0 && p[1] >= 0 && p[2] >= 0 && p[0] < size[0] && p[1] < size[1] && p[2] < size[2] &&
              rho(p) >= 0)
            mask.setOn(n);
        }
        origins.emplace_back(x, y, z);
        masks.push_back(mask);
      }
  Medium medium;
  medium.density.topology = std::make_shared<const Topology>(origins, masks);
  medium.density.transform = transform;
  const Topology& topology = medium.topology();
  medium.density.values = Field<float>(topology);
  for (size_t b = 0; b < topology.blockCount(); ++b)
    for (auto it = topology.active(b).beginOn(); it; ++it)
      medium.density.values.block(b)[it.pos()] =
          static_cast<float>(rho(topology.origin(b) + voxelLocal(static_cast<int>(it.pos())) - offset));
  return medium;
}

/// A ball of density 1 and radius R (world) whose centre is a voxel corner, voxels of side h.
inline Medium ballMedium(double R, double h) {
  const int n = 2 * (static_cast<int>(R / h) + 2);
  return boxMedium(Coord(n), Transform::uniform(h), [=](Coord p) {
    const Vec3d d = (p.asVec3d() - Vec3d(0.5 * (n - 1))) * h;
    return d.length() < R ? 1.0 : -1.0;
  });
}

/// Largest |a - b| over active voxels, as a fraction of the largest |b|.
inline double largestDifference(const Topology& topology, const Field<float>& a, const Field<float>& b) {
  double difference = 0, largest = 0;
  for (size_t block = 0; block < topology.blockCount(); ++block)
    for (auto it = topology.active(block).beginOn(); it; ++it) {
      const double u = a.block(block)[it.pos()], v = b.block(block)[it.pos()];
      difference = std::max(difference, std::abs(u - v));
      largest = std::max(largest, std::abs(v));
    }
  return largest > 0 ? difference / largest : difference;
}

}  // namespace vdb_diffuse
