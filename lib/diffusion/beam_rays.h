#pragma once

#include <array>
#include <functional>

#include "diffusion/first_scatter.h"
#include "diffusion/reflected_light.h"

namespace vdb_diffuse {

/// Light that travels in one direction everywhere.
struct Beam {
  Vec3d direction;       ///< unit length, world
  Vec3d power{0, 0, 0};  ///< its part of the mean over directions before attenuation: irradiance / (4 pi)
  bool from_surfaces = false;    ///< starts at surfaces that reflect, not from afar; `power` is then unused
  double weight = 1;             ///< factor on a reflected radiance: the direction's share of the sphere
  int rays = 1;                  ///< lattice rays per voxel and axis
  double shift[2] = {0.5, 0.5};  ///< of the lattice, 0..1 of its spacing
};

/// Where the rays of a beam pass a voxel's square across it, from its middle, in voxels; i, j = 0 .. rays
/// - 1. No two of a row or a column have the same height, so that rays x rays places along either axis tell
/// how much of the beam enters through a side.
inline std::array<double, 2> placeOfRay(const Beam& beam, int i, int j) {
  const double n = beam.rays;
  return {(i + (j + beam.shift[0]) / n) / n - 0.5, (j + (i + beam.shift[1]) / n) / n - 0.5};
}

/// Of the rays, in voxels, toward where they go along an axis. A beam of simple slopes would else meet the
/// edges of voxels, layer after layer, and pass between two opaque ones that touch there: of an oblique sun
/// on steps of opaque voxels 4 to 6 % did.
inline double asideOf(double direction) {
  constexpr double kAside = 0.021;
  return direction > 0 ? kAside : direction < 0 ? -kAside : 0;
}

/// Adds a beam to the first scatter of every voxel ray by ray, where surfaces may stand anywhere.
///
/// Rays stand on a square lattice in the plane across the grid axis that the beam is nearest to, one voxel
/// apart (or 1/rays). Each is followed once through the whole volume, exactly for constant voxels, and leaves
/// in every voxel its mean over the segment, times the segment's extent along the axis, as in beam_pass.h.
/// Surfaces end a ray, or start a reflected one. Tiles of rays run in four colours, so that no two threads
/// meet in a voxel and the order of sums is fixed.
class BeamRays {
 public:
  /// All references must outlive the object. \param channels  1 or 3
  BeamRays(const BeamMedium& medium, int channels, const Occluder& occluder, const ReflectedLight& reflected);

  void add(const Beam& beam, FirstScatter& sum) const;
  bool surfacesInside() const { return surfaces_inside_; }

 private:
  const BeamMedium& beams_;
  const Medium& medium_;
  const int channels_;
  const Occluder& occluder_;
  const ReflectedLight& reflected_;
  Vec3d middle_index_;            // of the active voxels
  double width_ = 0;              // of the volume's box from corner to corner, world
  bool surfaces_inside_ = false;  // a surface may come near the box
};

}  // namespace vdb_diffuse
