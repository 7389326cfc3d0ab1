#pragma once

#include "diffusion/beam_rays.h"

namespace vdb_diffuse {

/// Adds beams to the first scatter of every voxel, in one pass along each.
///
/// A beam's rays stand on lattices one voxel apart (ray_lattice.h), of which it has rays x rays that lie side
/// by side; beams of an octant pass a block together, block by block in the order of wavefront.h. O(N) for a
/// direction, where marching from every voxel to the light is O(N^(4/3)). The order of sums is fixed.
///
/// Rays carry light that starts as 1, once for every extinction among channels and media; colours are given
/// to what they leave. Surfaces outside the volume's box hide a ray as a whole, or light it as a whole where
/// they reflect; among surfaces that stand in the box, and in boxes too wide for the planes of all rays, each
/// ray is followed by itself (beam_rays.h).
class BeamSweep {
 public:
  /// All references must outlive the object. \param channels  1 or 3
  BeamSweep(const BeamMedium& medium, int channels, const Occluder& occluder,
            const ReflectedLight& reflected);

  void add(const std::vector<Beam>& beams, FirstScatter& sum, const Progress& progress = {}) const;

 private:
  const BeamMedium& medium_;
  const int channels_;
  const Occluder& occluder_;
  const ReflectedLight& reflected_;
  BeamRays by_rays_;
};

}  // namespace vdb_diffuse
