#pragma once

#include <memory>

#include "diffusion/equation.h"
#include "surfaces/surface_light.h"

namespace vdb_diffuse {

/// Powers through the outer faces of every voxel, of radiance in mean voxel sizes squared.
struct FaceLight {
  Field<float> entering, leaving;
};

/// A few rays through the whole medium, for the light that leaves it through an outer face and meets it again
/// at another. Faces with a wall of their own in the equation do not count.
class FaceProbe {
 public:
  /// All but the directions must outlive the object.
  FaceProbe(const Medium& medium, const Occluder& occluder, const std::vector<Surface>& surfaces,
            const Walls& walls, const DirectionSet& directions);

  const Medium& medium() const { return medium_; }
  const Walls& walls() const { return walls_; }
  const Vec3d& stretch() const { return stretch_; }

  /// Faces of a block's voxels beside voxels that are not active, with no wall between.
  std::array<BlockMask, 6> openFaces(size_t block) const;
  /// What surfaces receive and throw back of one channel's light; null where there are none.
  std::unique_ptr<SurfaceLight> surfaceLight(int channel) const;

  /// Where the whole medium glows with a source function of 1. Surfaces stop the rays, and what reaches one
  /// that reflects is thrown back in a second pass.
  FaceLight glow(const ChannelOptics& optics, int channel) const;
  /// What enters the voxels of a medium with the source function S inside.
  /// \param faces    the open faces of an equation, by block
  /// \param leaving  the source function that stands for S in rays that leave through those faces
  /// \param surfaces  what they receive is kept there; may be null
  Field<float> entering(const ChannelOptics& optics, const Field<float>& S,
                        const std::vector<std::vector<OpenFace>>& faces, const FaceValues& leaving,
                        SurfaceLight* surfaces) const;

 private:
  const Medium& medium_;
  const std::vector<Surface>& surfaces_;
  const Walls& walls_;
  const Vec3d stretch_;
  const Wavefront wavefront_;
  const SurfaceCuts cuts_;

  template <typename Visit>
  void walk(const ChannelOptics& optics, const Obstacles* obstacles, const Visit& visit) const;
  FaceLight pass(const ChannelOptics& optics, const Obstacles* obstacles) const;
};

/// Optical depths of a block's voxels.
void depthsOf(const ChannelOptics& optics, const Medium& medium, size_t block, float* tau);

}  // namespace vdb_diffuse
