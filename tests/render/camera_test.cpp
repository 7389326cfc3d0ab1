#include "render/camera.h"

#include <gtest/gtest.h>

#include <cmath>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

std::vector<Vec3d> corners(const Vec3d& low, const Vec3d& high) {
  std::vector<Vec3d> points;
  for (int i = 0; i < 8; ++i)
    points.emplace_back(i & 1 ? high[0] : low[0], i & 2 ? high[1] : low[1], i & 4 ? high[2] : low[2]);
  return points;
}

/// Where a point of a perspective picture falls, in pixels, found from the rays alone.
Vec3d project(const Camera& camera, const Vec3d& p_world) {
  const Vec3d middle = camera.ray(camera.width() / 2.0, camera.height() / 2.0).direction;
  const auto onPlane = [&](double x, double y) {
    const Vec3d d = camera.ray(x, y).direction;
    return d / d.dot(middle);
  };
  const Vec3d origin = onPlane(0, 0), across = onPlane(1, 0) - origin, down = onPlane(0, 1) - origin;
  const Vec3d v = p_world - camera.position();
  const Vec3d d = v / v.dot(middle) - origin;
  return Vec3d(d.dot(across) / across.lengthSqr(), d.dot(down) / down.lengthSqr(), v.dot(middle));
}

TEST(Camera, TheWholeVolumeIsInViewAndFillsIt) {
  for (const Vec3d& high : {Vec3d(1, 1, 1), Vec3d(100, 1, 1), Vec3d(1, 1, 100), Vec3d(1e-3, 2e-3, 1e-3)})
    for (const bool has_from : {false, true})
      for (const int width : {200, 50}) {
        CameraSettings settings;
        settings.width = width;
        settings.height = 100;
        const auto box = corners(Vec3d(0), high);
        if (has_from) settings.from = high * 3 + Vec3d(0, 0, high.length());
        const Camera camera(settings, box);
        double fill = 0;
        for (const Vec3d& corner : box) {
          const Vec3d pixel = project(camera, corner);
          EXPECT_GT(pixel[2], 0);
          const double reach = std::max(std::abs(2 * pixel[0] / width - 1), std::abs(2 * pixel[1] / 100 - 1));
          EXPECT_LE(reach, 1);
          fill = std::max(fill, reach);
        }
        EXPECT_GT(fill, 0.9);
      }
}

TEST(Camera, UpIsUpAndRightIsRight) {
  for (const Vec3d& up : {Vec3d(0, 0, 1), Vec3d(0, 1, 0)}) {
    CameraSettings settings;
    settings.up = up;
    const Camera camera(settings, corners(Vec3d(-1), Vec3d(1)));
    EXPECT_LT(camera.forward().dot(up), 0);  // from above the horizon
    EXPECT_GT(camera.ray(480, 0).direction.dot(up), camera.ray(480, 540).direction.dot(up));
    EXPECT_NEAR(camera.ray(0, 270).direction.dot(up), camera.ray(960, 270).direction.dot(up), 1e-12);
    const Vec3d right = camera.ray(960, 270).direction - camera.ray(0, 270).direction;
    EXPECT_GT(right.dot(camera.forward().cross(up)), 0);
  }
}

TEST(Camera, FovIsTheAngleAcrossTheWidth) {
  CameraSettings settings;
  settings.fov = 1.1;
  settings.from = Vec3d(5, 6, 7);
  const Camera camera(settings, corners(Vec3d(-1), Vec3d(1)));
  EXPECT_NEAR(std::acos(camera.ray(0, 270).direction.dot(camera.ray(960, 270).direction)), 1.1, 1e-9);
  EXPECT_LT((camera.ray(480, 270).direction - Vec3d(-5, -6, -7).unit()).length(), 1e-12);
}

TEST(Camera, OrthoIsTheWidthInWorldUnits) {
  CameraSettings settings;
  settings.ortho = 7;
  const Camera camera(settings, corners(Vec3d(-1), Vec3d(1)));
  EXPECT_NEAR((camera.ray(0, 270).origin - camera.ray(960, 270).origin).length(), 7, 1e-12);
  EXPECT_NEAR((camera.ray(480, 0).origin - camera.ray(480, 540).origin).length(), 7 * 540 / 960.0, 1e-12);
}

TEST(Camera, LooksStraightDown) {
  CameraSettings settings;
  settings.from = Vec3d(0, 0, 10);
  const Camera camera(settings, corners(Vec3d(-1), Vec3d(1)));
  for (double x : {0.0, 480.0, 960.0}) EXPECT_TRUE(camera.ray(x, 100).direction.isFinite());
  EXPECT_NEAR(camera.ray(480, 270).direction[2], -1, 1e-12);
}

TEST(Camera, LightTravelsAgainstTheRay) {
  CameraSettings settings;
  const Camera camera(settings, corners(Vec3d(-1), Vec3d(1)));
  const Ray ray = camera.ray(100.5, 40.5);
  EXPECT_LT((camera.toward(ray.origin + ray.direction * 3) + ray.direction).length(), 1e-12);
}

TEST(Camera, OutlineHoldsTheActiveVoxelsAndNoMore) {
  Volume volume;
  std::vector<BlockMask> active(2);
  active[0].setOn(voxelOffset(7, 1, 2));
  active[1].setOn(voxelOffset(3, 4, 5));
  volume.topology = std::make_shared<Topology>(std::vector<Coord>{{-8, 0, 0}, {16, 0, 0}}, active);
  volume.transform = Transform::uniform(0.5, Vec3d(100, 0, 0));
  Vec3d low(1e9), high(-1e9);
  for (const Vec3d& p : outline(volume))
    for (int a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], p[a]);
      high[a] = std::max(high[a], p[a]);
    }
  EXPECT_EQ(low, Vec3d(100 - 0.75, 0.25, 0.75));
  EXPECT_EQ(high, Vec3d(100 + 9.75, 2.25, 2.75));
}

TEST(Camera, RefusesViewsThatAreNone) {
  const auto box = corners(Vec3d(-1), Vec3d(1));
  const auto refused = [&](auto change) {
    CameraSettings settings;
    change(settings);
    EXPECT_THROW(Camera(settings, box), UsageError);
  };
  refused([](CameraSettings& s) { s.from = s.look_at = Vec3d(1, 2, 3); });
  refused([](CameraSettings& s) { s.from = Vec3d(std::nan(""), 0, 0); });
  refused([](CameraSettings& s) { s.fov = 0.0; });
  refused([](CameraSettings& s) { s.fov = 3.2; });
  refused([](CameraSettings& s) { s.ortho = -1.0; });
  refused([](CameraSettings& s) { s.fov = s.ortho = 1.0; });
  refused([](CameraSettings& s) { s.width = 0; });
}

}  // namespace
}  // namespace vdb_diffuse
