#pragma once

#include "medium/medium.h"

namespace vdb_diffuse {

/// Cubes of `width`^3 voxels, their active voxels taken together: what blobs are fitted to, and the points of
/// the integrals over them. Cells are numbered block by block.
///
/// Positions are in the grid's frame, see blob.h.
struct Cells {
  int width = 1;                    ///< voxels, 1, 2, 4 or 8
  Coord origin{0, 0, 0};            ///< voxel at the frame's zero
  Vec3d stretch{1, 1, 1};           ///< a voxel's size along each axis, in mean voxel sizes
  std::vector<size_t> first;        ///< by block its first cell; one more at the end
  std::vector<Vec3d> corner;        ///< by block the centre of its lowest voxel
  std::vector<int32_t> at;          ///< by block and place in it the cell, -1 where nothing is active
  std::vector<Vec3d> centre;        ///< mean position of the active voxels
  std::vector<float> volume, mass;  ///< count of the active voxels, sum of their densities

  size_t count() const { return centre.size(); }
  int perBlock() const { return kBlockVoxels / (width * width * width); }
  /// The cell of a voxel of a block; the voxel must be active.
  int32_t of(size_t block, int voxel) const {
    const Coord p = voxelLocal(voxel);
    const int side = kBlockWidth / width;
    return at[block * perBlock() + ((p[0] / width) * side + p[1] / width) * side + p[2] / width];
  }
  Vec3d frame(const Coord& p_index) const {
    const Coord d = p_index - origin;
    return Vec3d(d[0] * stretch[0], d[1] * stretch[1], d[2] * stretch[2]);
  }
};

/// The widest cells of which there are at least `least`, or single voxels.
Cells findCells(const Medium& medium, size_t least);

/// Sum of term(block, voxel) over the active voxels of every cell.
template <typename Term>
std::vector<double> sumOverCells(const Cells& cells, const Topology& topology, const Term& term) {
  std::vector<double> sum(cells.count(), 0.0);
  forEachBlock(topology.blockCount(), [&](size_t b) {
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      sum[cells.of(b, n)] += term(b, n);
    }
  });
  return sum;
}

}  // namespace vdb_diffuse
