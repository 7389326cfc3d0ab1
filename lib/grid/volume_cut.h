#pragma once

#include <optional>

#include "grid/volume.h"

namespace vdb_diffuse {

/// Corners of a box with sides along the world's axes.
struct WorldBox {
  Vec3d low{0, 0, 0}, high{0, 0, 0};
  bool holds(const Vec3d& p) const {
    for (int a = 0; a < 3; ++a)
      if (!(p[a] >= low[a] && p[a] <= high[a])) return false;
    return true;
  }
};

/// What is left of a volume.
struct VolumeCut {
  double least = 0;              ///< voxels of a smaller value go
  std::optional<WorldBox> crop;  ///< voxels whose centre lies outside go

  bool any() const { return least > 0 || crop; }
};

/// The volume without the voxels that go: they are not active, and blocks that lose all are gone.
Volume cut(Volume volume, const VolumeCut& how);

/// Both volumes in one, values added where both are active. Their voxels must coincide: axes alike, and whole
/// voxels between the origins. The name and the place are those of the first.
/// \throws InputError that says how they differ
Volume sum(Volume a, const Volume& b);

}  // namespace vdb_diffuse
