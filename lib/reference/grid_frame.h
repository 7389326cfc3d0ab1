#pragma once

#include "reference/voxel_walk.h"

namespace vdb_diffuse {

/// Between the world and the orthonormal frame along the grid's axes, in which paths fly. It may be a mirror
/// image of the world, which light does not notice.
class GridFrame {
 public:
  explicit GridFrame(const Transform& transform) : transform_(transform), h_(transform.meanVoxelSize()) {
    for (int a = 0; a < 3; ++a) {
      axis_[a] = transform.axis(a) / transform.axis(a).length();
      per_h_[a] = static_cast<float>(h_ / transform.axis(a).length());
    }
  }

  double h() const { return h_; }  ///< the unit of length of the walk, world units
  /// In voxels, as VoxelWalk counts them.
  Vec3d cellOf(const Vec3d& p_world) const { return transform_.toIndex(p_world) + Vec3d(0.5); }
  Vec3d worldOf(const Vec3d& p_cell) const { return transform_.toWorld(p_cell - Vec3d(0.5)); }
  Vec3d toWorld(const Vec3f& s) const { return axis_[0] * s[0] + axis_[1] * s[1] + axis_[2] * s[2]; }
  Vec3f toGrid(const Vec3d& d) const {
    return Vec3f(static_cast<float>(d.dot(axis_[0])), static_cast<float>(d.dot(axis_[1])),
                 static_cast<float>(d.dot(axis_[2])));
  }
  /// Voxels per h along a unit direction of the frame; never zero, so that no division fails.
  Vec3f step(const Vec3f& s) const {
    Vec3f d;
    for (int a = 0; a < 3; ++a) {
      d[a] = s[a] * per_h_[a];
      if (std::abs(d[a]) < 1e-15f) d[a] = std::copysign(1e-15f, d[a]);
    }
    return d;
  }

 private:
  const Transform& transform_;
  double h_;
  Vec3d axis_[3];  // unit length, in the world
  float per_h_[3];
};

/// An even point of a voxel; `voxel` counts as fields do.
inline Place placeInVoxel(size_t voxel, RandomStream& random) {
  Place place;
  place.block = static_cast<int32_t>(voxel / kBlockVoxels);
  const Coord local = voxelLocal(static_cast<int>(voxel % kBlockVoxels));
  for (int a = 0; a < 3; ++a) {
    place.voxel[a] = local[a];
    place.x[a] = static_cast<float>(local[a] + random.uniform());
  }
  return place;
}

}  // namespace vdb_diffuse
