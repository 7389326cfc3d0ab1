#include "surfaces/surface_point.h"

#include <cmath>

namespace vdb_diffuse {

Vec3d offSurface(const SurfacePoint& at, double voxel, const Occluder& occluder) {
  // Embree's floats count from the middle of the surfaces, and are rounded by 6e-8 of the distance to it.
  const Vec3d middle = 0.5 * (occluder.lowest() + occluder.highest());
  return at.p + at.normal * (1e-3 * voxel + 1e-6 * (at.p - middle).length());
}

bool crowded(const SurfacePoint& at, double reach, double voxel, const Occluder& occluder) {
  const Vec3d from = offSurface(at, voxel, occluder);
  const Vec3d helper = std::abs(at.normal[0]) < 0.7 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
  const Vec3d u = at.normal.cross(helper).unit(), v = at.normal.cross(u);
  constexpr int kProbes = 8;
  for (int n = 0; n < kProbes; ++n) {
    const double angle = 2 * M_PI * (n + 0.5) / kProbes;
    if (occluder.hidden(from, u * std::cos(angle) + v * std::sin(angle), reach)) return true;
  }
  return false;
}

bool seeEachOther(const SurfacePoint& a, const SurfacePoint& b, double voxel, const Occluder& occluder) {
  const Vec3d from = offSurface(a, voxel, occluder), way = offSurface(b, voxel, occluder) - from;
  const double distance = way.length();
  return !(distance > 0) || !occluder.hidden(from, way / distance, distance);
}

}  // namespace vdb_diffuse
