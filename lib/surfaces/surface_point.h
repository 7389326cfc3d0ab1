#pragma once

#include "scene/occluder.h"

namespace vdb_diffuse {

/// A point of one side of a surface, world; the normal points away from that side, unit length.
struct SurfacePoint {
  Vec3d p, normal;
};

/// A start for rays from a surface that do not meet the surface itself. \param voxel  mean size, world
Vec3d offSurface(const SurfacePoint& at, double voxel, const Occluder& occluder);

/// True where something stands on a surface, or the surface bends up, within `reach`: what lies there may be
/// on the other side of a wall.
bool crowded(const SurfacePoint& at, double reach, double voxel, const Occluder& occluder);

/// Nothing stands between two points.
bool seeEachOther(const SurfacePoint& a, const SurfacePoint& b, double voxel, const Occluder& occluder);

}  // namespace vdb_diffuse
