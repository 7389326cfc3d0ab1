#pragma once

#include <openvdb/Types.h>
#include <openvdb/math/Mat3.h>
#include <openvdb/math/Vec3.h>

#include <cmath>

namespace vdb_diffuse {

using openvdb::Mat3d;
using openvdb::Vec3d;

/// From index space, where voxel (i,j,k) is the cube of side 1 about (i,j,k), to world space. Linear with
/// orthogonal axes: translation, rotation, mirror, and a voxel size that may differ per axis.
class Transform {
 public:
  Transform() : Transform(Vec3d(1, 0, 0), Vec3d(0, 1, 0), Vec3d(0, 0, 1), Vec3d(0, 0, 0)) {}
  /// \param x,y,z   world vectors of one step along each index axis: orthogonal, finite, not zero
  /// \param origin  world position of the centre of voxel (0,0,0)
  Transform(const Vec3d& x, const Vec3d& y, const Vec3d& z, const Vec3d& origin)
      : axis_{x, y, z}, origin_(origin) {}
  static Transform uniform(double voxel_size, const Vec3d& origin = Vec3d(0)) {
    return Transform(Vec3d(voxel_size, 0, 0), Vec3d(0, voxel_size, 0), Vec3d(0, 0, voxel_size), origin);
  }

  Vec3d toWorld(const Vec3d& p_index) const { return directionToWorld(p_index) + origin_; }
  Vec3d toIndex(const Vec3d& p_world) const { return directionToIndex(p_world - origin_); }
  /// Vectors, not normals: the length changes with the voxel size.
  Vec3d directionToWorld(const Vec3d& v) const { return axis_[0] * v[0] + axis_[1] * v[1] + axis_[2] * v[2]; }
  Vec3d directionToIndex(const Vec3d& v) const {
    return Vec3d(v.dot(axis_[0]) / axis_[0].lengthSqr(), v.dot(axis_[1]) / axis_[1].lengthSqr(),
                 v.dot(axis_[2]) / axis_[2].lengthSqr());
  }
  /// World vector of one step along an index axis.
  const Vec3d& axis(int a) const { return axis_[a]; }
  const Vec3d& origin() const { return origin_; }
  Vec3d voxelSize() const { return Vec3d(axis_[0].length(), axis_[1].length(), axis_[2].length()); }
  double voxelVolume() const { return axis_[0].length() * axis_[1].length() * axis_[2].length(); }
  /// Side of the cube of a voxel's volume: the `h` of the discrete equations.
  /// Exact for cubes, and scales exactly with powers of two.
  double meanVoxelSize() const {
    const Vec3d size = voxelSize();
    return size[0] * std::cbrt((size[1] / size[0]) * (size[2] / size[0]));
  }

 private:
  Vec3d axis_[3], origin_;
};

}  // namespace vdb_diffuse
