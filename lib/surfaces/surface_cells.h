#pragma once

#include <unordered_map>
#include <vector>

#include "grid/topology.h"
#include "grid/transform.h"
#include "scene/scene.h"

namespace vdb_diffuse {

/// A piece of one side of a surface: what of it lies in one cube of an octree about the volume and faces one
/// of the grid's six directions most.
struct CellKey {
  int32_t surface;
  int8_t side;   ///< 2 axis + (1: the side's normal points up the axis)
  int8_t level;  ///< the cube is 2^level voxels wide
  int32_t i, j, k;
  bool operator==(const CellKey& o) const {
    return surface == o.surface && side == o.side && level == o.level && i == o.i && j == o.j && k == o.k;
  }
  bool operator<(const CellKey& o) const;
};

struct CellHash {
  size_t operator()(const CellKey& key) const;
};

/// The octree: its cubes are a voxel wide beside the volume, or as asked for, and grow with the distance.
/// Small triangles share cells and large ones are spread over many, so that every cell meets about as many
/// rays as its neighbours.
class CellTree {
 public:
  /// \param finest_level  of the cubes beside the volume
  CellTree(const Topology& topology, const Transform& transform, const std::vector<Surface>& surfaces,
           int finest_level = 0);
  /// Doubles the cubes beside the volume: keys made before are of another tree.
  void widen() { ++finest_level_; }

  CellKey keyOf(int surface, uint32_t triangle, bool front, const Vec3d& p_index) const;
  /// World area of a triangle in a cell's cube.
  double areaIn(const CellKey& cell, int surface, uint32_t triangle) const;
  /// Cubes of a level that the triangle's bounding box touches: inclusive ranges of i, j, k.
  void range(int level, int surface, uint32_t triangle, double low[3], double high[3]) const;
  /// Is this cube, of the key's level, cut no further, and its parent is?
  bool isLeaf(const CellKey& key) const;
  int sideOf(int surface, uint32_t triangle, bool front) const;
  const std::vector<Surface>& surfaces() const { return surfaces_; }
  double meanVoxelSize() const { return transform_.meanVoxelSize(); }

 private:
  const Transform& transform_;
  const std::vector<Surface>& surfaces_;
  int finest_level_;
  Vec3d anchor_, low_, high_;  // in voxels: a corner of all cubes, the volume's box about it

  bool fits(const CellKey& key) const;                        // small enough for its distance
  Vec3d corner(int surface, uint32_t triangle, int n) const;  // in voxels, from the anchor
};

/// Cells that rays have met, in the order of their keys. Rays are few in a cell, and where a cell's cube
/// holds only a sliver of its surface their number has little to do with its area: so a cell's irradiance is
/// that of the cells about it together.
struct SurfaceCells {
  std::vector<CellKey> keys;
  std::vector<uint32_t> first,
      around;               ///< of the cells about each cell and it itself, and where its list begins
  std::vector<float> area;  ///< of all the surface about the cell, in mean voxel sizes squared, > 0
};

/// \param met  keys of the cells that rays have met, sorted, each once
SurfaceCells makeSurfaceCells(const CellTree& tree, std::vector<CellKey> met);

}  // namespace vdb_diffuse
