#pragma once

#include <cstdint>

#include "shapes/sizing.h"

namespace vdb_diffuse {

/// A cumulus: billows on billows over a flattish base, z up, with soft edges, thin wisps about it and small
/// detached pieces. About 10 units wide; more voxels resolve finer detail of the same cloud.
struct CloudSettings {
  ShapeSize size;
  uint64_t seed = 1;
  double peak = 5;  ///< highest density inside, > 0
};

/// Heap of balls (lobes.h), eroded by octaves of noise from the size of the smallest balls down to two
/// voxels, after Ebert et al. (2003), "Texturing and Modeling", chapter 9. The result depends on the settings
/// alone, not on threads. Throws InputError where it would not fit in memory.
Volume makeCloud(const CloudSettings& settings);

}  // namespace vdb_diffuse
