#pragma once

#include "shapes/sizing.h"

namespace vdb_diffuse {

/// Volumes of plain form, centred on the world's origin: their mass, their chords and their jumps are known
/// on paper. `kShapeWidth` wide unless the size says otherwise. All throw as `requireFeasible` does.

/// A ball of constant density.
Volume makeSphere(const ShapeSize& size, double density = 1);

/// A ball with a cavity of half its radius, whose voxels are active and hold zero.
Volume makeShell(const ShapeSize& size, double density = 1);

/// A block of constant density, as near to a cube as the number of voxels allows.
Volume makeBox(const ShapeSize& size, double density = 1);

/// The box in horizontal slabs of `cell` voxels, the lowest of the given density, the next of zero, and so
/// on, active everywhere. `cell` 0: an eighth of the height.
Volume makeLayers(const ShapeSize& size, double density = 1, int cell = 0);

/// The box in cubes of `cell` voxels a side whose density is by turns `density` and `contrast` times that.
Volume makeCheckerboard(const ShapeSize& size, double density = 1, double contrast = 1e6, int cell = 1);

/// One layer of voxels across z, as near to a square as the number allows, of the given optical depth across
/// at unit extinction.
Volume makeSheet(const ShapeSize& size, double optical_depth = 1);

}  // namespace vdb_diffuse
