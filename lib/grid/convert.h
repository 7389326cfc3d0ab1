#pragma once

#include <openvdb/version.h>

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "grid/volume.h"

namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {
class GridBase;
namespace math {
class Transform;
}
}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb

namespace vdb_diffuse {

/// Between OpenVDB's trees and frozen blocks. Trees are instantiated here and in census.cpp alone, as each
/// costs seconds to compile; everybody else passes `GridBase`. Errors are `InputError`s that begin with the
/// grid's name; the caller adds the file's.

/// A float, double, vec3s or vec3d grid as blocks: one field per component. Inactive voxels of the fields
/// hold zero; `background` is what the tree holds where it has nothing.
struct GridValues {
  std::shared_ptr<const Topology> topology = std::make_shared<Topology>();
  Transform transform;
  Channels channels;
  std::array<float, 3> background{0, 0, 0};
};

/// Tiles are voxelised; what that takes is known, and held against `max_bytes`, before anything is allocated.
/// Throws InputError for other types of grid, bad transforms, and active voxels beyond +-2^30.
GridValues valuesOf(const openvdb::GridBase& grid, uint64_t max_bytes);

/// The grid's world placement. Throws InputError where it is not linear, not finite, singular or sheared.
Transform transformOf(const openvdb::GridBase& grid);

/// A float or double grid at the active voxels of `target`: trilinear between voxel centres, inactive voxels
/// counting as zero; a plain copy where both have the same voxels. Needs no more memory than the result.
Field<float> sampleOnto(const openvdb::GridBase& grid, const Volume& target);

/// A float, double, vec3s or vec3d grid at the active voxels of `target`, one field per component: a plain
/// copy where both have the same voxels, else trilinear between those that are active around a place; zero
/// where none is. For what a volume's rim has as its inside does, as light: it does not fade there.
Channels interpolateOnto(const openvdb::GridBase& grid, const Volume& target);

/// The same for what is there outside the grid's active voxels as well: where none is near, the background.
struct FilledValues {
  Channels channels;
  std::array<float, 3> background{0, 0, 0};
  uint64_t outside = 0;  ///< voxels of the target with a value above zero that took the background
};
FilledValues fillOnto(const openvdb::GridBase& grid, const Volume& target);

/// Voxels of both lie within a thousandth of a voxel of each other, all over `where`.
bool sameVoxels(const Transform& a, const Transform& b, const Topology& where);

/// One channel makes a FloatGrid, three make a Vec3SGrid; background zero, active where the topology is.
std::shared_ptr<openvdb::GridBase> gridOf(const Topology& topology, const Channels& channels,
                                          const Transform& transform);

std::shared_ptr<openvdb::math::Transform> openvdbTransform(const Transform& transform);

}  // namespace vdb_diffuse
