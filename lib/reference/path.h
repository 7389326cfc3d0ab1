#pragma once

#include <functional>

#include "reference/sources.h"
#include "reference/tally.h"
#include "reference/voxel_walk.h"

namespace vdb_diffuse {

/// Follows single paths to their ends, and tallies what they leave on the way. One for each batch.
///
/// A ray that has not collided sends out walkers, as many as the power that collides on it is worth: each
/// carries the same power. Where rays are long and walks are short, as in thin media, there are many of them
/// to a ray.
class PathFollower {
 public:
  virtual ~PathFollower() = default;
  /// \param power   in the tally's units
  virtual void follow(const PathStart& start, const Vec3d& power, RandomStream& random) = 0;
  /// Walkers wait until there are many, or this is called after the last path.
  virtual void finish() = 0;
};

/// \param channels       1 or 3, as the tally has
/// \param walker_power   what a walker starts with, in the tally's units
/// \param goes_on        asked now and then on very long walks; after a false, what is tallied is of no use
std::unique_ptr<PathFollower> makeFollower(const Scenery& scenery, const VoxelWalk& walk, int channels,
                                           double walker_power, std::function<bool()> goes_on,
                                           BatchTally& tally);

}  // namespace vdb_diffuse
