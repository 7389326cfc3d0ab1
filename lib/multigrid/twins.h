#pragma once

#include <vector>

#include "multigrid/operator.h"

namespace vdb_diffuse {

// Lobes beside each other, and wisps beside a cloud, must not share a coarse voxel: it would tie together
// what is not, and light that is even in each but not the same, which the smoother hardly sees, could not be
// corrected. So a coarse voxel whose children are not joined inside it
//
//      +----+----+
//      | a  |    |       a and b touch at an edge only; the way from one to the other may be
//      +----+----+       long, or there may be none
//      |    | b  |
//      +----+----+
//
// stands for the largest set of them, and each further set has an unknown of its own at the same place, a
// twin; so it is with children that are joined, but much less than each is to others. There are few: 650
// beside the 285,000 voxels of the second level of a cloud of 2 M voxels, and without them its light takes 12
// iterations to 1e-4 and 25 to 1e-6 instead of 8 and 13. Blocks know nothing of them; what they add to a
// level is done one by one here.

/// An unknown of a level: its index in the level's fields, or ~t for twin t.
using Node = int64_t;

/// The twins of one level.
struct Twins {
  struct Link {
    Node to;
    float g;           ///< conductance
    int32_t row = -1;  ///< of the voxel that it leads to, in the level's Interpolation
  };
  std::vector<Coord> place;    ///< the voxel that each shares
  std::vector<float> sink;     ///< as in Operator
  std::vector<float> inverse;  ///< 1 / A_tt, 0 where that is 0
  std::vector<float> x, b;
  std::vector<int32_t> first;  ///< of each twin among `links`, and one past the last
  std::vector<Link> links;     ///< to voxels and twins at the same place or one step along an axis away

  size_t size() const { return place.size(); }
  size_t bytes() const {
    return size() * (sizeof(Coord) + 4 * sizeof(float) + sizeof(int32_t)) + links.size() * sizeof(Link);
  }
};

/// Unknowns whose interpolation from the next level is not what the blocks' kernels take it for: those with
/// twins for parents, beside such, linked to twins, and twins themselves.
struct Interpolation {
  struct Weight {
    Node coarse;
    float own, blocks;  ///< the weight, and what the kernels take it for
  };
  std::vector<Node> fine;
  std::vector<int32_t> first{0};  ///< of each row among `weights`, and one past the last
  std::vector<Weight> weights;

  size_t rows() const { return fine.size(); }
  size_t bytes() const { return rows() * (sizeof(Node) + sizeof(int32_t)) + weights.size() * sizeof(Weight); }
};

/// Sum over the faces of a voxel: visit(face, index of the voxel across, conductance), those that conduct.
template <typename Visit>
void forEachFace(const Operator& A, Node voxel, const Visit& visit) {
  const size_t b = static_cast<size_t>(voxel) / kBlockVoxels;
  const int n = static_cast<int>(voxel % kBlockVoxels);
  const Coord p = voxelLocal(n);
  const auto cuts = A.cuts.empty() ? A.cuts.end() : A.cuts.find(static_cast<int32_t>(b));
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2, up = face % 2, stride = 64 >> (3 * axis);
    Node next = voxel + (up ? stride : -stride);
    if (p[axis] == (up ? 7 : 0)) {
      const int32_t near = A.topology->neighbours(b)[face];
      if (near == kNoBlock) continue;
      next = Node{near} * kBlockVoxels + n + (up ? -7 : 7) * stride;
    }
    if (cuts != A.cuts.end() && cuts->second.cut[face].isOn(n)) continue;
    const float g = A.finest() ? A.scale[axis] / (A.half_resistance[voxel] + A.half_resistance[next])
                               : A.faces[axis][up ? next : voxel];
    if (g > 0) visit(face, next, g);
  }
}

/// x_t = (b_t + sum of g x_j) / A_tt for one twin after the other; in reverse, the adjoint.
/// \param pending  by row of the Interpolation, what x will get before it counts; null: nothing
void relaxTwins(Twins& twins, const Field<float>& x, bool reverse,
                const std::vector<float>* pending = nullptr);

/// b += what the voxels get from twins; the values it had, to be put back.
std::vector<float> addFromTwins(const Twins& twins, Field<float>& b);
void putBack(const Twins& twins, const std::vector<float>& before, Field<float>& b);

/// Mends the coarse right-hand sides after the blocks have restricted b - A x.
void restrictRows(const Operator& A, const Twins& twins, const Field<float>& b, const Field<float>& x,
                  const Interpolation& interpolation, Field<float>& coarse_b, Twins& coarse);

/// Adds to x, and to the twins' x, what the blocks do not.
/// \return by row, what they will add
std::vector<float> prolongRows(const Interpolation& interpolation, const Field<float>& e, const Twins& coarse,
                               Field<float>& x, Twins& twins);

}  // namespace vdb_diffuse
