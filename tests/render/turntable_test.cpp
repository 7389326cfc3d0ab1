#include "render/turntable.h"

#include <gtest/gtest.h>

namespace vdb_diffuse {
namespace {

const std::vector<Vec3d> kBox = [] {
  std::vector<Vec3d> corners;
  for (int n = 0; n < 8; ++n) corners.emplace_back(n & 1 ? 5 : 1, n & 2 ? 3 : 2, n & 4 ? 2 : 0);
  return corners;
}();
const Vec3d kMiddle(3, 2.5, 1);

/// Where a point comes to lie in the picture, as a share of its half width and half height.
std::pair<double, double> placed(const Camera& camera, const Vec3d& p) {
  const Vec3d d = p - camera.position();
  const Vec3d right =
      camera.ray(camera.width(), 0.5 * camera.height()).direction -
      camera.forward() * camera.ray(camera.width(), 0.5 * camera.height()).direction.dot(camera.forward());
  const Vec3d up = right.cross(camera.forward());
  const double depth = d.dot(camera.forward()), reach = depth * std::tan(camera.fov() / 2);
  return {d.dot(right.unit()) / reach, d.dot(up.unit()) / reach * camera.width() / camera.height()};
}

TEST(Turntable, GoesAroundOnceAtOneHeightAndDistance) {
  CameraSettings view;
  view.from = Vec3d(3, -7.5, 4);
  const std::vector<CameraSettings> views = turntable(view, kBox, 4);
  ASSERT_EQ(views.size(), 4u);
  const Vec3d expected[] = {Vec3d(3, -7.5, 4), Vec3d(13, 2.5, 4), Vec3d(3, 12.5, 4), Vec3d(-7, 2.5, 4)};
  for (int n = 0; n < 4; ++n) {
    EXPECT_LT((*views[n].from - expected[n]).length(), 1e-9) << n;
    EXPECT_LT((*views[n].look_at - kMiddle).length(), 1e-12);
    EXPECT_EQ(views[n].fov, views[0].fov);
  }
}

TEST(Turntable, KeepsTheVolumeInViewFromEverySide) {
  for (const Vec3d& up : {Vec3d(0, 0, 1), Vec3d(0, 1, 0)}) {
    CameraSettings view;
    view.up = up;
    for (const CameraSettings& settings : turntable(view, kBox, 7)) {
      const Camera camera(settings, kBox);
      double widest = 0;
      for (const Vec3d& corner : kBox) {
        const auto [x, y] = placed(camera, corner);
        EXPECT_LT(std::abs(x), 1);
        EXPECT_LT(std::abs(y), 1);
        widest = std::max({widest, std::abs(x), std::abs(y)});
      }
      EXPECT_GT(widest, 0.3) << "and not from far away";
    }
  }
}

TEST(Turntable, TakesWhatIsSaid) {
  CameraSettings view;
  view.ortho = 8;
  view.look_at = Vec3d(1, 1, 1);
  for (const CameraSettings& settings : turntable(view, kBox, 3)) {
    EXPECT_EQ(settings.ortho, 8);
    EXPECT_FALSE(settings.fov);
    EXPECT_EQ(*settings.look_at, Vec3d(1, 1, 1));
  }
  view.ortho.reset();
  view.fov = 0.5;
  EXPECT_NEAR(*turntable(view, kBox, 3)[2].fov, 0.5, 1e-12);
}

}  // namespace
}  // namespace vdb_diffuse
