#include "render/turntable.h"

#include <algorithm>

namespace vdb_diffuse {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// About a unit axis, counter-clockwise as seen from its tip (Rodrigues).
Vec3d turned(const Vec3d& v, const Vec3d& axis, double angle) {
  return v * std::cos(angle) + axis.cross(v) * std::sin(angle) + axis * (axis.dot(v) * (1 - std::cos(angle)));
}

Vec3d middleOf(const std::vector<Vec3d>& points) {
  Vec3d low = points.front(), high = points.front();
  for (const Vec3d& p : points) {
    low = openvdb::math::minComponent(low, p);
    high = openvdb::math::maxComponent(high, p);
  }
  return (low + high) * 0.5;
}

/// Around the cylinder in which the points stay while they turn.
std::vector<Vec3d> sweptOutline(const std::vector<Vec3d>& points, const Vec3d& pivot, const Vec3d& up) {
  double radius = 0, low = HUGE_VAL, high = -HUGE_VAL;
  Vec3d farthest = Vec3d(up[1], up[2], up[0]);
  for (const Vec3d& p : points) {
    const double height = (p - pivot).dot(up);
    const Vec3d across = (p - pivot) - up * height;
    low = std::min(low, height);
    high = std::max(high, height);
    if (across.length() <= radius) continue;
    radius = across.length();
    farthest = across;
  }
  constexpr int kSides = 32;
  std::vector<Vec3d> swept;
  for (int n = 0; n < kSides; ++n)
    for (const double height : {low, high})
      swept.push_back(pivot + turned(farthest, up, 2 * kPi * n / kSides) + up * height);
  return swept;
}

}  // namespace

std::vector<CameraSettings> turntable(const CameraSettings& view, const std::vector<Vec3d>& outline,
                                      int frames) {
  CameraSettings first = view;
  first.look_at = view.look_at.value_or(middleOf(outline));
  const Vec3d pivot = *first.look_at;
  const Camera camera(first, sweptOutline(outline, pivot, view.up));
  first.from = camera.position();
  if (!first.ortho) first.fov = camera.fov();
  std::vector<CameraSettings> views(static_cast<size_t>(frames), first);
  for (int n = 0; n < frames; ++n)
    views[n].from = pivot + turned(camera.position() - pivot, view.up, 2 * kPi * n / frames);
  return views;
}

}  // namespace vdb_diffuse
