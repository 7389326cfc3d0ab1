#pragma once

#include <functional>

#include "grid/volume.h"

namespace vdb_diffuse {

/// How large a made volume should be. A shape has its own width in world units, whatever the number of
/// voxels: more voxels show the same thing more finely.
struct ShapeSize {
  size_t voxels = 1000000;  ///< active voxels to aim at, >= 1
  double voxel_size = 0;    ///< world units, > 0; 0: so that the shape has its own width
};

constexpr double kShapeWidth = 10;  ///< world units: side or diameter of the plain shapes

struct WorldBox {
  Vec3d low, high;
};

/// Fills a shape of its own width, `make(h)` with voxels of size h, such that the active voxels are within 2
/// % of `size.voxels`, or as near as a few trials come. Then sets the voxel size that was asked for. \param
/// volume_of  estimate of the shape's active volume at voxel size h
Volume fillToSize(const ShapeSize& size, const std::function<double(double)>& volume_of,
                  const std::function<Volume(double)>& make);

/// Volume of the part of the box that is inside, by one random point in each of 72^3 cells. `is_inside` is
/// called from several threads at once.
double estimateVolume(const WorldBox& box, const std::function<bool(const Vec3d& p_world)>& is_inside);

/// Throws UsageError for a size that means nothing and InputError where making it cannot fit in this
/// machine's memory. \param leaf_fill  fraction of the voxels of touched blocks that will be active
void requireFeasible(const ShapeSize& size, double leaf_fill);

}  // namespace vdb_diffuse
