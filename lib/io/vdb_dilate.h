#pragma once

#include "grid/field.h"

namespace vdb_diffuse {

/// The topology widened by one voxel to all 26 sides.
Topology dilatedTopology(const Topology& topology);

/// A field of `topology` on the topology one layer wider: a new voxel has the mean of its old active
/// 26-neighbours, so that interpolation at the edge of the volume does not fade to zero.
///
///     . . . .        a a a .
///     . a b .   ->   a a b b      (in the plane; the corner sees a alone, the voxel above a sees a and b)
///     . . . .        a a b b
Field<float> dilatedField(const Topology& topology, const Field<float>& values, const Topology& dilated);

}  // namespace vdb_diffuse
