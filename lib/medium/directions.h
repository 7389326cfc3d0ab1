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

/// A set that is the same under every turn and mirror of the axes, so that a volume that is turned is lit the
/// same; its directions stand by octant, each octant's in the same order. Integrates polynomials in s up to
/// degree 5 (96 directions) or 9 (168), so that a phase function cut off at its second moment loses no
/// energy, and the flux through a plane across an axis of light that comes evenly from half the sphere.
/// Level- symmetric sets, made for polynomials over the whole sphere, have 1.7 % too much of that with 80
/// directions, 1.0 % with 168: as much as a surface then shines too brightly. No direction is
/// as near to one axis as to another, where a choice would not turn with the volume. \param size  96 or 168
DirectionSet halfRangeSet(int size);

/// 48 directions of equal weight, as symmetric, but none in a plane of symmetry: no ray of theirs runs
/// through the edges of voxels, where rounding would decide by which face it leaves. Exact up to fifth order.
DirectionSet offPlanes();
/// The half of them in which x, y, z change places in a ring, of the same order. A volume that is turned by a
/// quarter is lit by the other half, and a little differently.
DirectionSet offPlanesInRings();

}  // namespace vdb_diffuse
