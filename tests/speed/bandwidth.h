#pragma once

#include <cstddef>

namespace vdb_diffuse::speed {

/// What the memory does without a solver, on the threads that the scheduler has: the best of several passes
/// over arrays much larger than the caches. Copy and triad count bytes as STREAM does (McCalpin 1995), that
/// is, without what a cache reads before it is written.
struct Bandwidth {
  double copy = 0;   ///< c = a, GB/s
  double triad = 0;  ///< a = b + s c, GB/s
  double R = 0;  ///< d = a + b c in floats, 16 bytes for a voxel: ns per voxel, the unit of a solve's cost
};

Bandwidth measureBandwidth(size_t megabytes = 512);

}  // namespace vdb_diffuse::speed
