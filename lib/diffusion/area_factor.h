#pragma once

#include "grid/topology.h"
#include "grid/transform.h"

namespace vdb_diffuse {

/// The true area of a curved surface over the area of the voxel faces that stand for it,
///
///     a = |n|_2 / |n|_1,
///
/// for every voxel of a block with an open face; 1 elsewhere. A voxelised ball has 1.5 times its area, and
/// leaks 1.5 times too fast without this. The normal n is the first moment of the active mask over a ball of
/// radius 3 voxels, turned into a gradient by dividing by the voxel size per axis. Where the moment is too
/// small to name a direction (sheets, islands), a = 1. \param a  out: 512 factors in (1/sqrt(3), 1]
void areaFactors(const Topology& topology, const Vec3d& voxel_size, size_t block, float* a);

}  // namespace vdb_diffuse
