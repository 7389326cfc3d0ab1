#pragma once

#include <vector>

#include "grid/topology.h"
#include "grid/transform.h"

namespace vdb_diffuse {

/// One step of every ray of a lattice through a layer of voxels: voxel (u, v) of the layer is passed by ray
/// (u - shift_u, v - shift_v). Places are in voxels from the voxel's centre, along (w, u, v).
struct LayerStep {
  int shift_u, shift_v;
  float extent;             ///< along w, 0..1
  int entered_by, left_by;  ///< axis of the voxel's face: 0, 1, 2 for w, u, v
  float enters[3];          ///< where the step begins
  float moves[3];           ///< from there to its end
};

struct Layer {
  int steps = 0;
  LayerStep step[3];
  float centre[3] = {};    ///< of the rays' way through a voxel, along (w, u, v) from the voxel's centre
  float square[3] = {};    ///< of places on that way; 1/12 where the rays are spread over the voxel evenly
};

/// The rays of one direction: a square lattice, one voxel apart in the plane across axis w.
struct RayLattice {
  int w, u, v;           ///< axes: w is the one that the rays are nearest to; v is z, or y where w is z
  int sign;              ///< of the direction along w
  Vec3d s;               ///< unit length, along the grid's axes
  double weight;         ///< its share of the sphere
  size_t number = 0;     ///< of its direction among those of a wavefront
  float length;          ///< of a ray across one layer, in mean voxel sizes
  double cross_section;  ///< of a ray, in mean voxel sizes squared
  int first_layer;       ///< voxel coordinate along w of layers[0]
  std::vector<Layer> layers;
  int first_u, first_v, rows, pitch;  ///< ray (i, j) stands at (i - first_u) * pitch + (j - first_v)
  Vec3d start;  ///< of ray (0, 0), where it enters the first layer that it travels through, in voxels
  Vec3d along;  ///< from layer to layer

  size_t rays() const { return static_cast<size_t>(rows) * pitch; }
  size_t place(int i, int j) const {
    return static_cast<size_t>(i - first_u) * pitch + static_cast<size_t>(j - first_v);
  }
  /// The n-th layer on the way, by its coordinate along w.
  int layerCoordinate(int n) const {
    return first_layer + (sign > 0 ? n : static_cast<int>(layers.size()) - 1 - n);
  }
  const Layer& layerOnTheWay(int n) const { return layers[layerCoordinate(n) - first_layer]; }
};

/// Axes of the rays of one direction: w, and the two across it.
struct LatticeAxes {
  int w, u, v;
};
/// \param s  along the grid's axes;  \param stretch  voxel size along each axis over the mean voxel size
LatticeAxes latticeAxes(const Vec3d& s, const Vec3d& stretch);

/// \param lowest, highest  corners of the blocks, inclusive
/// \param through  a point, in voxels, that ray (0, 0) passes, such as the middle of the active voxels
RayLattice makeRayLattice(const Vec3d& s, double weight, const Vec3d& stretch, const Coord& lowest,
                          const Coord& highest, const Vec3d& through);

}  // namespace vdb_diffuse
