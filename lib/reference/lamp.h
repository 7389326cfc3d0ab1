#pragma once

#include <memory>

#include "reference/scenery.h"

namespace vdb_diffuse {

/// A light of the scene, to be drawn from in two ways.
class Lamp {
 public:
  virtual ~Lamp() = default;

  struct Ray {
    Vec3d origin, direction;
    Vec3d power{0, 0, 0};  ///< W; rays that miss the box have power too, which is not to be used
  };
  /// How many numbers a ray takes, 2 or 4.
  virtual int dimensions() const = 0;
  /// A ray aimed at the volume's box: averaged over draws, the power of those that meet it is what the lamp
  /// sends there.
  virtual Ray aimed(const double u[4], RandomStream& random) const = 0;

  struct Arrival {
    Vec3d origin;  ///< where the ray to the point starts; far outside for a lamp at infinity
    Vec3d direction;
    double distance = 0;        ///< to the point
    Vec3d irradiance{0, 0, 0};  ///< on a plane that faces it, W/m2
  };
  /// Light that arrives at a point unless something is in its way: one draw, whose average is all of it.
  virtual Arrival at(const Vec3d& point, const double u[2], RandomStream& random) const = 0;
};

/// Nothing where the light has no power.
std::unique_ptr<Lamp> lampOf(const Light& light, const Scenery& scenery);

}  // namespace vdb_diffuse
