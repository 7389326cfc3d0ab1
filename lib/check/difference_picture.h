#pragma once

#include <string>

#include "check/slice.h"

namespace vdb_diffuse {

/// What a picture of a difference says beside its three panels.
struct DifferenceWords {
  std::string title;     ///< "cloud_noon: grid diffuse"
  std::string subtitle;  ///< "relative RMS 3.1 %, limit 1 %"
  int block = 1;         ///< voxels to a side of what the grids call a voxel
};

/// A slice through the voxel `worst` as a PNG file's bytes: what is stored, what came out now, and the
/// difference, in red where it is now brighter and in blue where darker. The stored values and the new ones
/// share one scale, from zero to the larger of their largest. Of a coloured grid the component that is worst
/// at `worst` is shown. Where the slice has more voxels than a panel has pixels, a pixel shows the largest
/// difference among its voxels.
///
///      title
///      subtitle
///      +---------+  +---------+  +------------+
///      | stored  |  |   now   |  | now-stored |    the worst voxel is framed in each
///      +---------+  +---------+  +------------+
///      [=== scale ==============] [== scale ==]
std::string differencePicture(const GridValues& stored, const GridValues& now, const Coord& worst,
                              const DifferenceWords& words);

}  // namespace vdb_diffuse
