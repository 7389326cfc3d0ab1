#pragma once

#include "multigrid/transfer.h"

namespace vdb_diffuse {

/// Finds twins for the cells (2 x 2 x 2 voxels) that do not hang together, and mends what the blocks have
/// made of them: coarse sinks, faces and interpolation. Which voxels hang together, FirmSets says.
///
/// \param loose  by block, a bit for each cell (x*16 + y*4 + z) that might not hang together
/// \param coarse  as the blocks have formed it
/// \param most  twins; where more cells come apart, none is split
void splitCells(const Operator& fine, Twins& twins, std::vector<uint64_t> loose, size_t most,
                Transfer& transfer, Operator& coarse, Twins& coarse_twins);

}  // namespace vdb_diffuse
