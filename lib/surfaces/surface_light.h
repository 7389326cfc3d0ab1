#pragma once

#include "surfaces/surface_cuts.h"

namespace vdb_diffuse {

/// The light of one channel that surfaces receive and throw back from one sweep to the next, Lambertian on
/// either side: a cell of irradiance E sends out albedo E / pi in all directions.
class SurfaceLight {
 public:
  /// \param cuts  of the wavefront; both and the surfaces must outlive the object
  SurfaceLight(const Wavefront& wavefront, const SurfaceCuts& cuts, const std::vector<Surface>& surfaces,
               int channel);

  bool reflects() const;  ///< some cell has an albedo
  /// What stands in the way of a sweep, which then leaves here the light that it brought.
  Obstacles obstacles();
  /// From now on cells send out what the last sweep brought.
  void turn();

 private:
  const Wavefront& wavefront_;
  const SurfaceCuts& cuts_;
  std::vector<float> albedo_;     // by cell
  std::vector<double> received_;  // flux over 4 pi, in mean voxel sizes squared
  std::vector<float> radiance_;   // that leaves

  CutLight leaving(int octant) const;
  void arrived(int octant, const CutLight& light);
};

}  // namespace vdb_diffuse
