#pragma once

#include <array>
#include <memory>
#include <unordered_map>

#include "grid/field.h"

namespace vdb_diffuse {

/// Faces of one block's voxels through which nothing passes although both sides are active.
struct CutFaces {
  BlockMask cut[6];  ///< by Topology::Face, each over the block's voxels
};

/// The symmetric operator of a resistor network on the active voxels:
///
///     (A x)_i = sum over faces of g_ij (x_i - x_j)  +  sink_i x_i
///
///         +---------+---------+         i and j are joined by their half resistances in series:
///         |    i    |    j    |         g_ij = scale / (r_i + r_j), the harmonic mean of what
///         |    o-/\/\/-o-/\/\/-o         each side conducts, so that a jump between voxels is exact
///         |     r_i | r_j     |
///         +---------+---------+
///
/// The finest level keeps only r, and forms g while it is needed: 4 bytes for a voxel instead of 12. Coarse
/// levels keep g. Nothing here knows about light.
struct Operator {
  std::shared_ptr<const Topology> topology;
  Field<float> half_resistance;  ///< finest level: r > 0 in active voxels, infinity elsewhere
  std::array<float, 3> scale{1, 1,
                             1};  ///< finest level: factor on g along each axis (voxels that are not cubes)
  std::unordered_map<int32_t, CutFaces> cuts;  ///< finest level: by block, only where something is cut
  std::array<Field<float>, 3> faces;           ///< coarse levels: g to the lower neighbour along x, y, z
  Field<float> sink;                           ///< >= 0; 0 in inactive voxels
  Field<float> inverse_diagonal;               ///< 1 / A_ii; 0 in inactive voxels and where A_ii is 0

  bool finest() const { return !half_resistance.empty(); }
};

/// Fills `inverse_diagonal` from the rest.
void formDiagonal(Operator& A);

/// q = A p, and returns p.q
double apply(const Operator& A, const Field<float>& p, Field<float>& q);

/// r = b - A x in double, stored as float. Differences x_i - x_j are formed in double, so that a large,
/// smooth x does not drown the residual.
void residual(const Operator& A, const Field<float>& b, const Field<double>& x, Field<float>& r);

double dot(const Field<float>& a, const Field<float>& b);

/// Sum of r_i^2 / A_ii: the square of the diagonally scaled norm.
double scaledNormSquared(const Operator& A, const Field<float>& r);

}  // namespace vdb_diffuse
