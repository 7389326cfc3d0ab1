#pragma once

#include <optional>
#include <string>

#include "check/slice.h"

namespace vdb_diffuse {

/// Which slice of a grid, and how to show it.
struct SliceSettings {
  int axis = 2;              ///< of the world: the slice is normal to the voxel axis nearest to it
  std::optional<double> at;  ///< world coordinate along the axis; none: the middle of the active voxels
  std::optional<double> low, high;  ///< ends of the colour scale; none: 0, or the lowest value if that is
                                    ///< negative, and the highest value of the slice
  std::string title, unit;          ///< words; the unit may be empty
  bool length = false;              ///< vectors are shown by their length; else colours by their luminance
};

/// A slice of a grid, one voxel thick, as a PNG file's bytes: a square of pixels for a voxel, or where there
/// are more voxels than pixels, a pixel for one of them, and light grey where there is no voxel; a colour
/// scale, and where the slice lies.
/// \throws InputError where the grid has no active voxels or none in the slice's plane
std::string slicePicture(const GridValues& grid, const SliceSettings& settings);

/// The plane that the settings mean, over all active voxels.
SlicePlane slicePlane(const GridValues& grid, const SliceSettings& settings);

}  // namespace vdb_diffuse
