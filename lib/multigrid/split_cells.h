#pragma once

#include "multigrid/transfer.h"

namespace vdb_diffuse {

/// Finds twins for the cells (2 x 2 x 2 voxels) that do not hang together, and mends what the blocks have
/// made of them: coarse sinks, faces and interpolation.
///
/// One coarse unknown can stand for voxels that the smoother brings to the same value, or from there to their
/// own. So in each cell the set of voxels that is tied to another by the largest share of its ties joins that
/// one, until no such share is above kFirm, and each set that is left has an unknown. A set which itself is
/// tied together more than 1 / kAsFirm times as firmly as to the other does not join it, whatever the share:
/// the smoother moves it as a whole, and slowly. On raw densities (1 : 10,000) that halves the iterations
/// from 70 to 34 at 2 M voxels, to 1e-6; capped ones are evener, and 8 M voxels take 19 instead of 21.
///
/// \param loose  by block, a bit for each cell (x*16 + y*4 + z) that might not hang together
/// \param coarse  as the blocks have formed it
/// \param most  twins; where more cells come apart, none is split
void splitCells(const Operator& fine, Twins& twins, std::vector<uint64_t> loose, size_t most,
                Transfer& transfer, Operator& coarse, Twins& coarse_twins);

}  // namespace vdb_diffuse
