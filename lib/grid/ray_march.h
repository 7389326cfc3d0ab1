#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "grid/topology.h"
#include "grid/transform.h"

namespace vdb_diffuse {

/// Visits the voxels of a topology's blocks that a ray meets, nearest first, stepping over the space between
/// blocks: visit(block, voxel, t_enter, t_exit) -> bool, false to stop. Inactive voxels of a block are
/// visited too (their fields hold zero). After Amanatides and Woo (1987), on two levels.
///
/// \param p, d   origin and direction in index space, d not zero and not necessarily of unit length
/// \param t_min, t_max   the part of the ray p + t d that counts, t_max may be infinite
template <typename Visit>
void marchRay(const Topology& topology, const Vec3d& p, const Vec3d& d, double t_min, double t_max,
              const Visit& visit) {
  if (topology.blockCount() == 0) return;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vec3d inverse;
  for (int a = 0; a < 3; ++a) {  // clip against the box of all blocks; voxel i covers i-1/2 .. i+1/2
    inverse[a] = d[a] != 0 ? 1 / d[a] : kInfinity;
    const double low = topology.lowest()[a] - 0.5, high = topology.highest()[a] + 0.5;
    if (d[a] == 0) {
      if (p[a] < low || p[a] >= high) return;
      continue;
    }
    const double t0 = (low - p[a]) * inverse[a], t1 = (high - p[a]) * inverse[a];
    t_min = std::max(t_min, std::min(t0, t1));
    t_max = std::min(t_max, std::max(t0, t1));
  }
  if (!(t_min < t_max)) return;

  Coord voxel;
  for (int a = 0; a < 3; ++a) {
    voxel[a] = static_cast<int>(std::floor(p[a] + t_min * d[a] + 0.5));
    voxel[a] = std::clamp(voxel[a], topology.lowest()[a], topology.highest()[a]);
  }
  double t = t_min;
  while (true) {
    const Coord origin = blockOriginOf(voxel);
    const int32_t block = topology.find(origin);
    if (block == kNoBlock) {  // step to the face where the ray leaves this empty block
      int axis = 0;
      double t_leave = kInfinity;
      for (int a = 0; a < 3; ++a) {
        if (d[a] == 0) continue;
        const double face = origin[a] + (d[a] > 0 ? kBlockWidth - 0.5 : -0.5);
        const double t_face = (face - p[a]) * inverse[a];
        if (t_face < t_leave) {
          t_leave = t_face;
          axis = a;
        }
      }
      t = std::max(t, t_leave);
      if (!(t < t_max)) return;
      for (int a = 0; a < 3; ++a) {
        if (a == axis)
          voxel[a] = d[a] > 0 ? origin[a] + kBlockWidth : origin[a] - 1;
        else
          voxel[a] = std::clamp(static_cast<int>(std::floor(p[a] + t * d[a] + 0.5)), origin[a],
                                origin[a] + kBlockWidth - 1);
      }
      if (voxel[axis] < topology.lowest()[axis] || voxel[axis] > topology.highest()[axis]) return;
      continue;
    }
    double t_next[3];
    for (int a = 0; a < 3; ++a)
      t_next[a] = d[a] != 0 ? (voxel[a] + (d[a] > 0 ? 0.5 : -0.5) - p[a]) * inverse[a] : kInfinity;
    while (true) {
      const int axis =
          t_next[0] < t_next[1] ? (t_next[0] < t_next[2] ? 0 : 2) : (t_next[1] < t_next[2] ? 1 : 2);
      const double t_exit = std::min(t_next[axis], t_max);
      if (t_exit > t) {
        if (!visit(static_cast<size_t>(block), voxelOffset(voxel[0] & 7, voxel[1] & 7, voxel[2] & 7), t,
                   t_exit))
          return;
        t = t_exit;
      }
      if (t >= t_max) return;
      voxel[axis] += d[axis] > 0 ? 1 : -1;
      t_next[axis] += std::abs(inverse[axis]);
      if (voxel[axis] < origin[axis] || voxel[axis] >= origin[axis] + kBlockWidth) break;
    }
    for (int a = 0; a < 3; ++a)
      if (voxel[a] < topology.lowest()[a] || voxel[a] > topology.highest()[a]) return;
  }
}

}  // namespace vdb_diffuse
