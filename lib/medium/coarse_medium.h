#pragma once

#include "medium/medium.h"

namespace vdb_diffuse {

/// The medium in voxels of twice the width: a voxel is active where one of its 2^3 children is, its density
/// is their mean with nothing where they are not active, so that no mass is lost, its albedo their mean
/// weighted by density, so that as much scatters, and its emission their mean weighted by what absorbs, so
/// that no power is lost; channel by channel, where what absorbs differs among them.
Medium coarsened(const Medium& medium);

}  // namespace vdb_diffuse
