#pragma once

#include <unordered_map>
#include <vector>

#include "grid/topology.h"
#include "grid/transform.h"
#include "scene/occluder.h"

namespace vdb_diffuse {

/// A face of a voxel with a surface between the voxel's centre and the next one's.
struct WallFace {
  uint16_t voxel;   ///< in its block
  uint8_t face;     ///< Topology::Face
  int32_t surface;  ///< the surface nearest to the voxel
  float area;       ///< true area over voxel faces, |n|_2 / |n|_1 of the surface's normal in the grid's frame
};

/// Where surfaces cut the diffusion, by block: sorted by voxel and face; only blocks that have some. A wall
/// between two active voxels appears once for either side. Surfaces just outside active voxels count too:
/// they send light back where otherwise it would escape.
using Walls = std::unordered_map<int32_t, std::vector<WallFace>>;

Walls findWalls(const Topology& topology, const Transform& transform, const Occluder& occluder,
                const std::vector<Surface>& surfaces);

/// Entry for a voxel's face, or nullptr.
const WallFace* wallAt(const Walls& walls, size_t block, int voxel, int face);

}  // namespace vdb_diffuse
