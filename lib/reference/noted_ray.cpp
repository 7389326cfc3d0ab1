#include "reference/noted_ray.h"

#include <algorithm>

namespace vdb_diffuse {

Place NotedRay::placeAt(double column, const Vec3d& origin, const Vec3f& step, const VoxelWalk& walk) const {
  auto stretch = std::upper_bound(stretches_.begin(), stretches_.end(), column,
                                  [](double value, const Stretch& s) { return value < s.before; });
  --stretch;  // the first begins at 0
  while (stretch->rho == 0 && stretch != stretches_.begin()) --stretch;
  const double t = stretch->enter + (stretch->rho > 0 ? (column - stretch->before) / stretch->rho : 0.0);
  const Vec3d at = origin + Vec3d(step) * t;
  Place place;
  place.block = stretch->block;
  for (int a = 0; a < 3; ++a) {
    place.x[a] = static_cast<float>(std::clamp<double>(at[a] - walk.corner(place.block)[a], 0, kBlockWidth));
    place.voxel[a] = std::min(static_cast<int>(place.x[a]), kBlockWidth - 1);
  }
  return place;
}

}  // namespace vdb_diffuse
