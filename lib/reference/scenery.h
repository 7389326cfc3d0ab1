#pragma once

#include "medium/medium.h"
#include "reference/random.h"
#include "scene/occluder.h"

namespace vdb_diffuse {

/// The box around the active voxels, along the grid's axes, in the world.
class VolumeBox {
 public:
  explicit VolumeBox(const Volume& density);

  Vec3d centre() const { return corner_ + 0.5 * (edge_[0] + edge_[1] + edge_[2]); }
  /// Of the ball around the box.
  double radius() const { return 0.5 * (edge_[0] + edge_[1] + edge_[2]).length(); }
  /// The part of the ray p + t d, t >= 0, that is inside; false where there is none.
  bool meets(const Vec3d& p, const Vec3d& d, double& t_enter, double& t_exit) const;
  bool meets(const Vec3d& p, const Vec3d& d) const {
    double t0, t1;
    return meets(p, d, t0, t1);
  }
  /// Area of the shadow that light along d throws, and the even point of the lit faces that u and v in 0..1
  /// choose.
  double shadow(const Vec3d& d) const;
  Vec3d litPoint(const Vec3d& d, double u, double v) const;
  /// Area of the surface; the even point of it that u, v choose, and the normal there, inward.
  double area() const;
  Vec3d surfacePoint(double u, double v, Vec3d& inward) const;

 private:
  Vec3d corner_, edge_[3], normal_[3];  // unit normals along the edges
  double face_area_[3];

  Vec3d facePoint(int axis, bool high, double u, double v) const;
};

/// Directions in a cone: uniform within `cos_limit` of an axis.
struct Cone {
  Vec3d axis{0, 0, 1};
  double cos_limit = -1;
  double cap = 2;  ///< 1 - cos_limit, with all its digits for a narrow cone

  static Cone of(const Vec3d& axis, double half_angle) {
    const double s = std::sin(0.5 * half_angle);
    return {axis, std::cos(half_angle), 2 * s * s};
  }
  double solidAngle() const { return 2 * M_PI * cap; }
  bool contains(const Vec3d& d) const { return axis.dot(d) >= cos_limit; }
  Vec3d direction(double u, double v) const;
};

/// The directions in which a ball may be met from p: all where p is inside it.
Cone coneAround(const Vec3d& p, const Vec3d& centre, double radius);

/// About `normal` with density cos / pi, Malley's method.
Vec3d cosineDirection(const Vec3d& normal, double u, double v);

/// What all paths have in common: where the medium is, and what stands around it.
struct Scenery {
  Scenery(const Medium& medium, const Scene& scene);

  const Medium& medium;
  const Scene& scene;
  Occluder occluder;
  VolumeBox box;
  bool surfaces;         ///< there are any
  bool surfaces_inside;  ///< and one may lie within the volume's box
  double off_surface;    ///< how far a ray starts above the surface it leaves, world units
  double reach;          ///< a length that leads out of the volume and all surfaces from inside either

  struct SurfacePoint {
    Vec3d position, normal;  ///< the normal on the side that was met
    int surface = 0;
  };
  SurfacePoint pointOf(const Occluder::Hit& hit, const Vec3d& origin, const Vec3d& direction) const;
  /// Draws a direction in which a Lambertian surface sends light, half of them toward the volume where that
  /// is a small part of what the surface sees. Returns the ratio of (cos / pi) to the density drawn from.
  double reflect(const SurfacePoint& point, RandomStream& random, Vec3d& direction) const;
};

}  // namespace vdb_diffuse
