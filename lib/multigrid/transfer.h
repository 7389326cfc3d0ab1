#pragma once

#include <vector>

#include "multigrid/twins.h"

namespace vdb_diffuse {

// 1.5 times its share gives each of three outer faces out of six equal ones a quarter, which is linear
// interpolation; a little less suits ragged edges, and takes no more iterations inside.
constexpr float kLinear = 1.2f;
// A voxel keeps at least this much of its own parent, or the parent's other children would not feel it.
constexpr float kParentAtLeast = 0.25f;
// Coarse neighbours lie two voxels apart: about half the conductance of each path. A little less makes up for
// the smoothness that interpolation lacks: 9 instead of 10 iterations to 1e-6 on a cloud of 5 M voxels.
constexpr float kTwiceAsFar = 0.45f;

/// How a coarse level's voxels lie on a fine one: a coarse voxel is 2 x 2 x 2 fine ones, so each fine block
/// is one octant of its parent block. A fine voxel takes from its parent and from the coarse voxels across
/// its three outer faces, which in a uniform medium is nearly linear interpolation (a fifth each); otherwise
/// each outer face counts by its share of the voxel's conductance, so that nothing is interpolated across a
/// bad conductor. The code is in block_transfer.h, and in twins.h where coarse voxels have twins.
struct Transfer {
  std::vector<int32_t> parent;  ///< coarse block of each block
  Field<float> spill;           ///< scratch: what a block adds to coarse voxels of the six next octants
  Interpolation apart;          ///< rows that the blocks do not know
};

/// The next coarser operator: active where any child is, its sink the sum of the children's. A coarse
/// conductance is about half the sum of the four faces that cross the coarse face,
///
///      +----+----+----+----+
///      |         |         |       four paths side by side, each twice as long:
///      |    o----/\/\----o |       uniform medium: 4 * g/2 = 2 g, the operator on the coarse grid
///      |    I    |    J    |
///      +----+----+----+----+
///
/// so that voxels which do not touch stay apart wherever their coarse voxels differ; where they do not, one
/// of them gets a twin. Measured against putting the inner faces in series with the crossing one: fewer
/// iterations on wispy clouds and on raw densities.
///
/// \param twins  of the fine level, whose links learn their rows
/// \param most_twins  where more coarse voxels should have one, none gets any
/// \param coarse_twins  out
Operator coarsen(const Operator& fine, Twins& twins, size_t most_twins, Transfer& transfer,
                 Twins& coarse_twins);

/// Adds the links of twins to the sinks and diagonals of the voxels that they lead to; the last that is done
/// to a level, since coarsening wants its sinks alone.
void addLinks(const Twins& twins, Operator& A);

}  // namespace vdb_diffuse
