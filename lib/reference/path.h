#pragma once

#include "reference/sources.h"
#include "reference/tally.h"
#include "reference/voxel_walk.h"

namespace vdb_diffuse {

/// Follows single paths to their ends, and tallies what they leave on the way. One for each batch.
class PathFollower {
 public:
  virtual ~PathFollower() = default;
  /// \param power   in the tally's units
  /// \param u       where on the first ray the first collision is drawn, 0..1
  virtual void follow(const PathStart& start, const Vec3d& power, double u, RandomStream& random) = 0;
};

/// \param channels   1 or 3, as the tally has
std::unique_ptr<PathFollower> makeFollower(const Scenery& scenery, const VoxelWalk& walk, int channels,
                                           BatchTally& tally);

}  // namespace vdb_diffuse
