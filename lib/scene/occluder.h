#pragma once

#include <memory>
#include <optional>

#include "scene/scene.h"

namespace vdb_diffuse {

/// What a ray meets among a scene's surfaces. The only place that knows Embree; safe to ask from many
/// threads.
class Occluder {
 public:
  /// A scene without triangles costs nothing and hides nothing. Positions are moved to the scene's middle
  /// before they become float, so that a far-away world origin costs no precision.
  /// \throws std::invalid_argument where Embree would drop a primitive silently (not finite, too large)
  explicit Occluder(const std::vector<Surface>& surfaces);
  ~Occluder();
  Occluder(Occluder&&) noexcept;
  Occluder& operator=(Occluder&&) noexcept;

  bool empty() const;  ///< no triangles
  /// World bounding box of all surfaces. Only where not empty().
  Vec3d lowest() const;
  Vec3d highest() const;

  /// False where no surface meets this box: no triangle's own box does.
  bool comesNear(const Vec3d& lowest, const Vec3d& highest) const;

  struct Hit {
    int surface;        ///< index into the surfaces
    uint32_t triangle;  ///< index into the mesh's triangles
    double distance;
    double u, v;  ///< barycentric: (1-u-v) a + u b + v c
    bool front;   ///< the ray met the front (counter-clockwise) side
  };
  /// First surface on the ray from `origin` along `direction` (unit length) nearer than `distance`, which may
  /// be infinite. World space. Hits nearer than a small fraction of the scene are kept: the caller moves the
  /// origin off a surface it starts on.
  std::optional<Hit> closest(const Vec3d& origin, const Vec3d& direction, double distance) const;
  bool hidden(const Vec3d& origin, const Vec3d& direction, double distance) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vdb_diffuse
