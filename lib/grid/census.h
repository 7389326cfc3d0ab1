#pragma once

#include <openvdb/version.h>

#include <cstdint>
#include <vector>

#include "grid/topology.h"

namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {
class GridBase;
}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb

namespace vdb_diffuse {

/// What a grid holds, found on its tree without touching every voxel of a tile.
struct Census {
  uint64_t active_voxels = 0;
  uint64_t active_leaf_voxels = 0;
  uint64_t leaves = 0;
  uint64_t active_tiles = 0;
  std::vector<uint64_t>
      tiles_by_width;  ///< active tiles of 8, 128, 4096 voxels' width; empty: type not known
  Coord lowest{0, 0, 0}, highest{-1, -1, -1};  ///< of the active voxels, inclusive
  bool has_values = false;  ///< the rest counts active values, components together; only then
  double lowest_value = 0, highest_value = 0, mean = 0;  ///< of the finite ones
  uint64_t zeros = 0, negatives = 0, nonfinites = 0;
  struct Component {
    double lowest, highest;  ///< of the finite active values; 0 where there are none
    double background;       ///< what the tree holds where it has nothing
  };
  std::vector<Component> components;
};
Census census(const openvdb::GridBase& grid);

}  // namespace vdb_diffuse
