#include "render/camera.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "grid/error.h"
#include "grid/parallel.h"

namespace vdb_diffuse {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDefaultFov = 35 * kPi / 180;
constexpr double kWidestFov = 120 * kPi / 180;  // a fitted view is not opened wider: the corners would smear
constexpr double kMargin = 0.94;                // part of the picture that a fitted view fills

/// From the target to the camera where the user names neither: from the front left, 20 degrees above the
/// horizon.
Vec3d defaultOffset(const Vec3d& up) {
  const Vec3d across = up[2] != 0 ? Vec3d(1, 0, 0) : up[1] != 0 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
  const Vec3d front = across.cross(up);  // -y where z is up, z where y is up
  const double azimuth = -30 * kPi / 180, elevation = 20 * kPi / 180;
  return (front * std::cos(azimuth) + across * std::sin(azimuth)) * std::cos(elevation) +
         up * std::sin(elevation);
}

double middleAlong(const Vec3d& axis, const std::vector<Vec3d>& outline) {
  const auto nearer = [&](const Vec3d& a, const Vec3d& b) { return a.dot(axis) < b.dot(axis); };
  const auto [low, high] = std::minmax_element(outline.begin(), outline.end(), nearer);
  return (low->dot(axis) + high->dot(axis)) / 2;
}

}  // namespace

std::vector<Vec3d> outline(const Volume& volume) {
  const Topology& topology = *volume.topology;
  std::vector<Vec3d> points(topology.blockCount() * 8);
  forEachBlock(topology.blockCount(), [&](size_t b) {
    Coord low(kBlockWidth), high(0);
    for (auto voxel = topology.active(b).beginOn(); voxel; ++voxel) {
      const Coord p_local = voxelLocal(static_cast<int>(voxel.pos()));
      low.minComponent(p_local);
      high.maxComponent(p_local);
    }
    for (int i = 0; i < 8; ++i) {
      Vec3d p_index = topology.origin(b).asVec3d();
      for (int a = 0; a < 3; ++a) p_index[a] += (i >> a) & 1 ? high[a] + 0.5 : low[a] - 0.5;
      points[8 * b + i] = volume.transform.toWorld(p_index);
    }
  });
  return points;
}

Camera::Camera(const CameraSettings& settings, const std::vector<Vec3d>& outline)
    : width_(settings.width), height_(settings.height), orthographic_(settings.ortho.has_value()) {
  if (width_ < 1 || height_ < 1) throw UsageError("--size: a picture has at least one pixel each way");
  if (settings.fov && settings.ortho) throw UsageError("--fov and --ortho exclude each other: choose one");
  if (settings.fov && !(*settings.fov > 0 && *settings.fov < kPi))
    throw UsageError("--fov: an angle between 0 and 180 degrees is needed");
  if (settings.ortho && !(*settings.ortho > 0 && std::isfinite(*settings.ortho)))
    throw UsageError("--ortho: a width above 0 is needed");

  Vec3d low = outline.front(), high = outline.front();
  for (const Vec3d& point : outline) {
    low = openvdb::math::minComponent(low, point);
    high = openvdb::math::maxComponent(high, point);
  }
  const Vec3d middle = (low + high) * 0.5;
  Vec3d target = settings.look_at.value_or(middle);
  forward_ = settings.from ? target - *settings.from : -defaultOffset(settings.up);
  if (!(forward_.length() > 0) || !std::isfinite(forward_.length()))
    throw UsageError(
        "--from and --look-at: the camera needs a finite distance, not zero, from what it looks at");
  forward_.normalize();
  right_ = forward_.cross(settings.up);
  constexpr double kParallel = 1e-6;  // radians: straight down or up, where any right will do
  if (right_.length() < kParallel)
    right_ = forward_.cross(Vec3d(settings.up[1], settings.up[2], settings.up[0]));
  right_.normalize();
  up_ = right_.cross(forward_);
  if (!settings.from && !settings.look_at)  // what shows need not be in the middle of its box
    for (const Vec3d& axis : {right_, up_})
      target += axis * middleAlong(axis, outline) - axis * target.dot(axis);

  const double aspect = static_cast<double>(width_) / height_;
  if (orthographic_) {
    half_width_ = *settings.ortho / 2;
    position_ = settings.from.value_or(target - forward_ * (high - low).length());
    return;
  }
  // A point at right*x + up*y + forward*z from the camera is in view where |x| <= z tan, |y| <= z
  // tan/aspect.
  const auto reach = [&](const Vec3d& v) {
    return std::max(std::abs(v.dot(right_)), std::abs(v.dot(up_)) * aspect) / kMargin;
  };
  if (!settings.from) {
    half_width_ = std::tan(settings.fov.value_or(kDefaultFov) / 2);
    double distance = 0;
    for (const Vec3d& point : outline)
      distance = std::max(distance, reach(point - target) / half_width_ - (point - target).dot(forward_));
    position_ = target - forward_ * distance;
    return;
  }
  position_ = *settings.from;
  if (settings.fov) {
    half_width_ = std::tan(*settings.fov / 2);
    return;
  }
  half_width_ = 0;
  for (const Vec3d& point : outline) {
    const double depth = (point - position_).dot(forward_);
    half_width_ = depth > 0 ? std::max(half_width_, reach(point - position_) / depth)
                            : std::numeric_limits<double>::infinity();
    if (depth <= 0) break;
  }
  half_width_ = std::min(half_width_, std::tan(kWidestFov / 2));
}

Ray Camera::ray(double x, double y) const {
  const double u = (2 * x / width_ - 1) * half_width_;
  const double v = (height_ - 2 * y) / width_ * half_width_;
  if (orthographic_)
    return {position_ + right_ * u + up_ * v, forward_, -std::numeric_limits<double>::infinity()};
  Vec3d direction = forward_ + right_ * u + up_ * v;
  direction.normalize();
  return {position_, direction, 0};
}

Vec3d Camera::toward(const Vec3d& p_world) const {
  if (orthographic_) return -forward_;
  Vec3d s = position_ - p_world;
  return s.normalize() ? s : -forward_;
}

}  // namespace vdb_diffuse
