#pragma once

#include "medium/ray_cuts.h"
#include "medium/wavefront.h"

namespace vdb_diffuse {

/// What a sweep transports. The source function in a voxel about x_c, in the direction s, is
/// J + slope.(x - x_c) + sum over k of angular_k b_k(s), x in voxels, b_k of angular_basis.h along the grid's
/// axes.
struct SweepSource {
  Field<float> tau;                   ///< extinction times the mean voxel size: optical depth, >= 0
  Field<float> J;                     ///< W/m2/sr
  VectorField slope;                  ///< per voxel
  std::vector<Field<float>> angular;  ///< none, kFirstOrder or kSecondOrder of them
};

struct SweepResult {
  Field<float> mean;                  ///< of the radiance over directions and voxel
  Field<float> divergence;            ///< of the flux, per mean voxel size: what the rays gain in the voxel
  std::vector<Field<float>> moments;  ///< means of b_k times the radiance
  VectorField
      slope;  ///< of the mean, per voxel: the straight line's with the same first moment; only if wanted
  double escaped = 0;  ///< net flux that leaves for afar and to obstacles, in mean voxel sizes squared
};

/// Integrates the transport equation once along each direction of a set, with a given source and nothing
/// coming in from outside.
///
/// The rays of a direction stand on a lattice, one voxel apart across the grid axis that the direction is
/// nearest to. Then all rays look alike where they pass a layer of voxels: each takes the same one to three
/// steps through it, at the same fractions of the layer,
///
///        |   /|   |          so that eight rays side by side are eight voxels side by side, and each voxel
///        |  / |   |          meets every step once. A step is solved exactly for a source that is linear in
///        | /  |   |          the voxel, and what the rays lose is what the voxels gain.
///        |/   |   |
///
/// O(N) for a direction; the order of every sum is fixed.
/// \param moments  how many to return: 0, kFirstOrder or kSecondOrder, and at least the source's
/// \param want_slope  return the slope as well
/// \param obstacles  what stands in the rays' way; null: nothing
SweepResult sweep(const Wavefront& wavefront, const SweepSource& source, size_t moments,
                  bool want_slope = false, const Obstacles* obstacles = nullptr);

}  // namespace vdb_diffuse
