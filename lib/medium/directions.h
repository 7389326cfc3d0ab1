#pragma once

#include <openvdb/Types.h>

#include <vector>

namespace vdb_diffuse {

/// Directions and weights that stand for the sphere: unit vectors, weights that add up to 1.
struct DirectionSet {
  std::vector<openvdb::Vec3d> s;
  std::vector<double> weight;
  size_t size() const { return s.size(); }
};

/// The level-symmetric set LQ_n, n (n + 2) directions, the same under every turn and mirror of the axes, so
/// that a volume that is turned is lit the same: Carlson's, from Lewis and Miller, "Computational methods of
/// neutron transport" (1984), table 4-1. Integrates polynomials in s up to order n at least, so that a phase
/// function cut off at order n/2 loses no energy. Directions stand by octant, each octant's in the same
/// order. \param order  n: 4, 6, 8, 12 or 16
DirectionSet levelSymmetric(int order);

/// 48 directions of equal weight, as symmetric, but none in a plane of symmetry: no ray of theirs runs
/// through the edges of voxels, where rounding would decide by which face it leaves. Exact up to fifth order.
DirectionSet offPlanes();

}  // namespace vdb_diffuse
