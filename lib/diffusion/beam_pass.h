#pragma once

#include "grid/row.h"
#include "medium/ray_lattice.h"

namespace vdb_diffuse {

/// Where a beam's rays run in the voxels of one layer across axis w, over all its lattices; along (w, u, v),
/// in voxels from a voxel's centre. All voxels of a layer meet the same rays, and a beam that they find even
/// must have no moments.
struct LayerPlaces {
  float centre[3], square[3];  ///< means of x and x^2 over the rays in a voxel
  float stretch[3];            ///< of moments: few rays side by side cover less than the voxel
};

/// By layer, as in `lattices[n]->layers`; the lattices are those of one direction.
std::vector<LayerPlaces> layerPlaces(const std::vector<const RayLattice*>& lattices);

/// What a beam leaves in a block: means over each voxel of its light, and of the light times where it is.
struct BeamMarks {
  alignas(64) float light[kBlockVoxels];
  alignas(64) float lean[3][kBlockVoxels];    ///< times x, along (w, u, v)
  alignas(64) float spread[3][kBlockVoxels];  ///< times x^2 less that of even light

  void clear(bool with_shape);
};

/// A block as a beam passes it: rows of eight voxels, addressed by their place along w and u.
struct BeamBlock {
  const float* rho;
  const uint8_t* active;  ///< a byte for each row
  int stride_w, stride_u;
  Coord origin;
};

/// Takes the rays of one lattice through a block: each is followed exactly for constant voxels, and leaves in
/// every voxel its mean over the segment times the segment's extent along w,
///
///      |  / |  / |  / |       at each height one ray passes through each voxel, so the extents in a
///      | /  | /  | /  |       voxel add up to one: no normalisation, and what the rays lose is what
///      |/   |/   |/   |       the voxels gain
///      +----+----+----+
///
/// \param extinction  optical depth of a voxel of mean size per density
/// \param share  of this lattice in the beam
/// \param moments  null: only the light is wanted
/// \param rays  the lattice's plane
void passBeam(const RayLattice& lattice, const BeamBlock& block, double extinction, double share,
              const std::vector<LayerPlaces>* moments, float* rays, BeamMarks& marks);

}  // namespace vdb_diffuse
