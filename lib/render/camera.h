#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "grid/volume.h"

namespace vdb_diffuse {

/// Points whose convex hull holds the active voxels, in world space: the corners of each block's active part.
std::vector<Vec3d> outline(const Volume& volume);

struct Ray {
  Vec3d origin;     ///< world
  Vec3d direction;  ///< unit length, away from the camera
  double t_min;     ///< where along the ray seeing starts: 0, or minus infinity for an orthographic camera
};

/// What a user says about the view; what is left out is chosen so that the whole volume is in view.
struct CameraSettings {
  int width = 960, height = 540;  ///< pixels
  std::optional<Vec3d> from;      ///< world; default: obliquely from above the horizon
  std::optional<Vec3d> look_at;   ///< world; default: the middle of the volume
  std::optional<double> fov;      ///< radians across the picture's width, 0..pi
  std::optional<double> ortho;    ///< world width of an orthographic picture, > 0; excludes `fov`
  Vec3d up{0, 0, 1};              ///< a unit vector along an axis
};

/// A pinhole or an orthographic camera. Square pixels; (0,0) is the upper left corner of the picture.
///
///        up                      x = 0 .. width
///        |   forward           +------------------+  y = 0
///        |  /                  |                  |
///        o ---- right          +------------------+  y = height
class Camera {
 public:
  /// \param outline  what is to be in view, not empty
  /// \throws UsageError for a view that is none: no distance to the target, an angle or a width out of range
  Camera(const CameraSettings& settings, const std::vector<Vec3d>& outline);

  int width() const { return width_; }
  int height() const { return height_; }
  const Vec3d& position() const { return position_; }
  const Vec3d& forward() const { return forward_; }
  /// Radians across the picture's width; of a pinhole.
  double fov() const { return 2 * std::atan(half_width_); }
  /// \param x, y  in pixels; the middle of the upper left pixel is (0.5, 0.5)
  Ray ray(double x, double y) const;
  /// Direction in which light travels from `p_world` to the camera, unit length.
  Vec3d toward(const Vec3d& p_world) const;

 private:
  int width_, height_;
  bool orthographic_;
  double half_width_;  // world units, or tan(fov/2)
  Vec3d position_, forward_, right_, up_;
};

}  // namespace vdb_diffuse
