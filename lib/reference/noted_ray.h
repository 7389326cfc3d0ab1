#pragma once

#include <vector>

#include "reference/voxel_walk.h"

namespace vdb_diffuse {

/// The voxels that a ray has crossed, so that a collision can be put where the ray has a given column of
/// density behind it.
class NotedRay {
 public:
  struct Stretch {  ///< in one voxel
    int32_t block;
    float rho;
    double enter;   ///< at this length, in h
    double before;  ///< column up to there
  };

  void clear() { stretches_.clear(); }
  void note(const Stretch& stretch) { stretches_.push_back(stretch); }
  size_t size() const { return stretches_.size(); }

  /// \param column  of those that the ray has crossed
  /// \param origin, step  of the ray, in voxels and voxels per h
  Place placeAt(double column, const Vec3d& origin, const Vec3f& step, const VoxelWalk& walk) const;

 private:
  std::vector<Stretch> stretches_;
};

}  // namespace vdb_diffuse
