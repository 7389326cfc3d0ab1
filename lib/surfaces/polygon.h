#pragma once

#include <openvdb/Types.h>

#include <vector>

namespace vdb_diffuse {

using openvdb::Vec3d;

/// The part of a convex polygon where sign * (p[axis] - at) >= 0, or > 0 for the negative sign: a polygon on
/// the plane itself belongs to one side.
inline void clip(std::vector<Vec3d>& polygon, int axis, double at, int sign) {
  const auto inside = [&](const Vec3d& p) { return sign > 0 ? p[axis] >= at : p[axis] < at; };
  std::vector<Vec3d> kept;
  for (size_t n = 0; n < polygon.size(); ++n) {
    const Vec3d &p = polygon[n], &q = polygon[(n + 1) % polygon.size()];
    if (inside(p)) kept.push_back(p);
    if (inside(p) != inside(q)) kept.push_back(p + (q - p) * ((at - p[axis]) / (q[axis] - p[axis])));
  }
  polygon.swap(kept);
}

}  // namespace vdb_diffuse
