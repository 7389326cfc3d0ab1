#pragma once

#include <array>

#include "grid/topology.h"

namespace vdb_diffuse {

/// The cells between voxel centres, where a trilinear interpolant is one smooth piece: cell (i,j,k) has the
/// voxels i..i+1, j..j+1, k..k+1 at its corners. They reach half a voxel past the active voxels, across the
/// faces of blocks that have no neighbour, so that nothing is cut off where a block ends.
///
///     +---+---+---+     + voxel faces      o voxel centres
///     | o-|-o-|-o |
///     +-|-+-|-+-|-+     o-o
///     | o-|-o-|-o |     | |  one cell
///     +---+---+---+     o-o
struct DualCells {
  /// Cells with at least one active voxel at a corner.
  Topology cells;
  /// Per block of cells: the voxels' blocks at its origin + 8*(x,y,z), x,y,z in {0,1}, at index 4x+2y+z.
  std::vector<std::array<int32_t, 8>> voxel_blocks;
};

DualCells dualCells(const Topology& voxels);

}  // namespace vdb_diffuse
