#pragma once

#include <memory>

#include "reference/scenery.h"

namespace vdb_diffuse {

/// How a path begins.
struct PathStart {
  enum class Kind {
    kNothing,  ///< the draw misses the volume, or is another source's to make
    kRay,      ///< at `origin` along `direction`, not collided
    kSurface,  ///< on a surface: `power` arrives at `point`
    kMedium    ///< in a voxel that glows, in any direction
  };
  Kind kind = Kind::kNothing;
  Vec3d power{0, 0, 0};  ///< W; the average over draws is the power of all such starts
  Vec3d origin, direction;
  Scenery::SurfacePoint point;
  size_t voxel = 0;
};

/// A way to draw starts. All ways together draw every start with the right average power, each start in one
/// way: light on its way into the volume's box, surfaces or not, is drawn by where it meets the box; light
/// that misses the box, by the surface that it meets, so that a wide ground takes the paths it is worth.
class Source {
 public:
  virtual ~Source() = default;
  /// How many of its numbers matter most: 2 or 4, to be spread evenly together.
  virtual int dimensions() const = 0;
  /// \param u  four numbers in 0..1, of which the first `dimensions` are spread evenly over many draws
  virtual PathStart start(const double u[4], RandomStream& random) const = 0;
  /// How much of a start's power is expected to reach the medium.
  virtual double worth(const PathStart& start) const;

  double worth_of_all = 0;  ///< W, by a trial
  double share = 0;         ///< of all paths
};

/// Every source of a scene, with shares by a trial of what they are worth. Empty where nothing shines.
std::vector<std::unique_ptr<Source>> sourcesOf(const Scenery& scenery);

}  // namespace vdb_diffuse
