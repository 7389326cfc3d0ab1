#pragma once

#include "grid/convert.h"

namespace vdb_diffuse {

/// A grid at 1/width of its resolution: the voxel (i,j,k) of the result has the mean of the active voxels of
/// the cell of width^3 voxels that begins at (i,j,k) * width, and is active where the cell has any.
GridValues cellMeans(const GridValues& grid, int width);

}  // namespace vdb_diffuse
