#pragma once

#include <utility>
#include <vector>

#include "grid/convert.h"

namespace vdb_diffuse {

/// One voxel thick: which axis it is normal to, where, and which voxels it spans.
struct SlicePlane {
  int normal = 2;             ///< index axis
  int right = 0, up = 1;      ///< index axes of the picture
  Coord lowest{0, 0, 0};      ///< of the voxels shown, inclusive
  Coord highest{-1, -1, -1};  ///< likewise; both agree along `normal`

  int width() const { return highest[right] - lowest[right] + 1; }
  int height() const { return highest[up] - lowest[up] + 1; }
};

/// Through voxel `at`, normal to the axis along which the grids are shortest, over all that both have active.
SlicePlane sliceThrough(const Coord& at, const Topology& a, const Topology& b);

/// The values of one component in a plane, row after row, the uppermost first; the background where a grid
/// has no voxel.
std::vector<float> sliceValues(const GridValues& grid, int component, const SlicePlane& plane);

}  // namespace vdb_diffuse
