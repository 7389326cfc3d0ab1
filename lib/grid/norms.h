#pragma once

#include "grid/convert.h"

namespace vdb_diffuse {

/// How far grid A is from grid B over the union of their active voxels, a grid's background standing in where
/// it has no voxel. The samples are voxels, or the weighted averages of cells of `block`^3 voxels, anchored
/// at the index origin; the components of a vector are samples of the same weight, and a grid of one
/// component meets one of three as grey. With d = a - b and weights w (1 without a weight grid; a cell has
/// the sum of its voxels'):
///
///   noise    sqrt(sum w se^2 / sum w b^2), the standard error se of B where it is known; 0 otherwise
///   rel_rms  sqrt(sum w d^2 / sum w b^2 - noise^2), 0 where the noise is the larger
///   bias     sum w d / sum w |b|
///   p50 p95 p99   the value that |d| / mean |b| does not exceed in that share of the weight
///   max      the largest |d| / mean |b| of a sample with weight, and max_at its voxel (or cell's lowest
///   voxel)
///
/// with mean |b| = sum w |b| / sum w. Relative to one mean, not to the local b, so that dark voxels do not
/// rule. Where B is zero everywhere, norms are 0 for an A that is zero as well, else infinite. Samples with a
/// value that is not finite, in A, B or se, are counted and left out.
struct Norms {
  double rel_rms = 0, bias = 0, p50 = 0, p95 = 0, p99 = 0, max = 0, noise = 0;
  Coord max_at{0, 0, 0};
  double mean = 0;         ///< mean |b|, the unit of the percentiles and of max
  uint64_t samples = 0;    ///< that took part
  uint64_t nonfinite = 0;  ///< voxels left out
};

/// \param standard_error, weight   may be null; weights are one component, finite, >= 0
/// Throws InputError where the grids' voxels do not lie in the same places, and for bad weights.
Norms compareGrids(const GridValues& a, const GridValues& b, const GridValues* standard_error,
                   const GridValues* weight, int block);

/// The largest sum of values over a line of voxels along index axis `axis`: times the voxel's length and the
/// extinction, the optical depth of the densest column.
double heaviestColumn(const Topology& topology, const Field<float>& values, int axis);

}  // namespace vdb_diffuse
