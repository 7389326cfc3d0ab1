#pragma once

#include <vector>

#include "multigrid/pieces.h"

namespace vdb_diffuse {

/// How a coarse level's voxels lie on a fine one: a coarse voxel is 2 x 2 x 2 fine ones of one part, so each
/// part of a fine block is one octant of its parent block. A fine voxel takes from its parent and from the
/// coarse voxels across its three outer faces, which in a uniform medium is nearly linear interpolation (a
/// fifth each); otherwise each outer face counts by its share of the voxel's conductance, so that nothing is
/// interpolated across a bad conductor. The code is in block_transfer.h.
struct Transfer {
  Parts parts;
  std::vector<int32_t> parent;                    ///< coarse block of each part
  std::vector<std::array<int32_t, 6>> neighbour;  ///< parts of the same layer across the faces; -1: none
  Field<float> spill;  ///< scratch: what a part adds to coarse voxels of the six next octants
};

/// The next coarser operator on the given parts: active where any child is, its sink the sum of the
/// children's. A coarse conductance is about half the sum of the four faces that cross the coarse face,
///
///      +----+----+----+----+
///      |         |         |       four paths side by side, each twice as long:
///      |    o----/\/\----o |       uniform medium: 4 * g/2 = 2 g, the operator on the coarse grid
///      |    I    |    J    |
///      +----+----+----+----+
///
/// so that voxels which do not touch stay apart wherever their coarse voxels differ. Measured against putting
/// the inner faces in series with the crossing one: fewer iterations on wispy clouds and on raw densities.
Operator coarsen(const Operator& fine, Parts parts, Transfer& transfer);

}  // namespace vdb_diffuse
