#pragma once

#include <functional>

#include "grid/volume.h"

namespace vdb_diffuse {

/// A density that is given by a formula, in the coordinates of voxels. Both functions are called from several
/// threads at once.
struct Formula {
  Coord lowest, highest;  ///< a box of voxels that holds all active ones, both inclusive

  /// Whether any voxel of the box may be active; "yes" is always allowed and costs time only.
  std::function<bool(const Coord& lowest, const Coord& highest)> may_touch = [](const Coord&, const Coord&) {
    return true;
  };
  /// Writes the 512 densities of the block at `origin` and switches its active voxels on. `values` comes in
  /// as zeros, and inactive voxels must keep them.
  std::function<void(const Coord& origin, float* values, BlockMask& active)> fill;
};

/// The formula's active voxels as a volume, `voxel_size` world units wide, voxel (0,0,0) at `origin`. Memory
/// is about twice that of the result while it runs.
Volume sparseFill(const Formula& formula, double voxel_size, const Vec3d& origin = Vec3d(0));

}  // namespace vdb_diffuse
