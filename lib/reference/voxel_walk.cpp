#include "reference/voxel_walk.h"

#include <algorithm>
#include <cmath>

namespace vdb_diffuse {

VoxelWalk::VoxelWalk(const Topology& topology) : topology_(topology) {
  for (size_t b = 0; b < topology_.blockCount(); ++b) corners_.push_back(topology_.origin(b).asVec3d());
  for (int a = 0; a < 3; ++a) {
    lowest_[a] = topology_.lowest()[a] >> 3;
    highest_[a] = topology_.highest()[a] >> 3;
  }
}

bool VoxelWalk::enter(const Vec3d& c, const Vec3d& d, double limit, double& t, Place& place) const {
  if (topology_.blockCount() == 0) return false;
  t = 0;
  double t_end = limit;
  for (int a = 0; a < 3; ++a) {
    const double low = 8.0 * lowest_[a], high = 8.0 * highest_[a] + 8;
    const double t0 = (low - c[a]) / d[a], t1 = (high - c[a]) / d[a];
    t = std::max(t, std::min(t0, t1));
    t_end = std::min(t_end, std::max(t0, t1));
  }
  if (!(t < t_end)) return false;
  Coord block;
  for (int a = 0; a < 3; ++a) {
    const double at = std::floor((c[a] + t * d[a]) / kBlockWidth);
    block[a] =
        static_cast<int>(std::clamp(at, static_cast<double>(lowest_[a]), static_cast<double>(highest_[a])));
  }
  return findBlock(block, c, d, limit, t, place);
}

/// From `block`, which the ray enters at t, on.
bool VoxelWalk::findBlock(Coord block, const Vec3d& c, const Vec3d& d, double limit, double& t,
                          Place& place) const {
  double next[3];
  for (int a = 0; a < 3; ++a) next[a] = (kBlockWidth * (block[a] + (d[a] > 0 ? 1.0 : 0.0)) - c[a]) / d[a];
  while (true) {
    place.block =
        topology_.find(Coord(block[0] * kBlockWidth, block[1] * kBlockWidth, block[2] * kBlockWidth));
    if (place.block != kNoBlock) {
      for (int a = 0; a < 3; ++a) {
        const double x = c[a] + t * d[a] - kBlockWidth * static_cast<double>(block[a]);
        place.x[a] = static_cast<float>(std::clamp(x, 0.0, static_cast<double>(kBlockWidth)));
        place.voxel[a] = std::min(static_cast<int>(place.x[a]), kBlockWidth - 1);
      }
      return true;
    }
    const int axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    t = std::max(t, next[axis]);
    if (t >= limit) return false;
    block[axis] += d[axis] > 0 ? 1 : -1;
    if (block[axis] < lowest_[axis] || block[axis] > highest_[axis]) return false;
    next[axis] += kBlockWidth / std::abs(d[axis]);
  }
}

/// From the face where the ray left `place.block` toward `across` to the next block there is.
bool VoxelWalk::crossGap(Place& place, const Vec3f& d, const Coord& across, float limit,
                         float& travelled) const {
  const Coord& origin = topology_.origin(place.block);
  const Vec3d c = origin.asVec3d() + Vec3d(place.x);
  Coord block;
  for (int a = 0; a < 3; ++a) {
    block[a] = (origin[a] >> 3) + across[a];
    if (block[a] < lowest_[a] || block[a] > highest_[a]) return false;
  }
  double t = 0;
  const bool found = findBlock(block, c, Vec3d(d), limit - travelled, t, place);
  travelled = t < limit - travelled ? static_cast<float>(travelled + t) : limit;
  return found;
}

}  // namespace vdb_diffuse
