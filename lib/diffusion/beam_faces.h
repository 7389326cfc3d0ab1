#pragma once

#include "grid/transform.h"
#include "medium/attenuation.h"
#include "multigrid/block_kernel.h"

namespace vdb_diffuse {

/// Where a beam scatters in a voxel of many optical depths: beside the faces by which it comes in. A few rays
/// pass such a voxel too coarsely to tell: the hundredth part that they leave in its middle would be held
/// there, and diffuse light be brighter by the voxel's resistance.
///
///          s         Light that enters through a face is taken for even on it. After the way t, 1 from the
///      \ \ \ \       first to the last plane across the axis that the beam is nearest to, what came in
///     +-------+      along axis a is at -1/2 + s_a t there, and spread over what the sides have not yet let
///     |\ \ \ \|\     out along b: a part 1 - s_b t of the width. So means over the voxel are those of 1, t
///     | \ \ \ | \    and t^2, times exp(-tau t) and what is left.
///     +-------+
///
/// Moments are along the axis of entry alone. Across it light counts as even: it goes out by the face beside
/// it, wherever on that face it came in, and the equation would send a part of it to the next one. With the
/// moments across, a voxel that three faces light held its light 1.4 times too deep.
///
/// How much comes in by each face follows from the voxel before it, along axis b: what is not gone on the way
/// through it passes evenly, and else what came in there along a leaves through b's side near the edge where
/// it entered, as s_a times the mean of exp(-tau t) (1 - s_c t). That voxel is taken to be lit as this one
/// is. Exact in the limit of many optical depths on an even surface.
class BeamFaces {
 public:
  /// Optical depths on the way from plane to plane. Voxels of fewer than the first are left to rays, which
  /// know more of the light that comes; from the second on nothing is.
  static constexpr float kThin = 4, kThick = 12;

  /// \param s  the direction, unit length, along the grid's axes
  /// \param stretch  voxel size along each axis over the mean voxel size
  /// \param extinction  optical depth of a voxel of mean size per density
  BeamFaces(const Vec3d& s, const Vec3d& stretch, double extinction);

  /// Moments of a beam of mean 1, see BeamShape, for a row of voxels.
  struct Moments {
    Row lean[3], spread[3];
  };
  /// \param rho  their densities
  /// \param before  of the voxels that light comes from along each axis, 0 where there is none
  VDB_DIFFUSE_INLINE Moments moments(Row rho, const Row before[3]) const;

  /// How far moments by rays are replaced, 0..1; for a row of voxels, or one.
  template <typename Number>
  VDB_DIFFUSE_INLINE Number share(Number rho) const;
  bool any(float densest) const { return densest * depth_per_density_ > kThin; }

  /// Where light comes from along an axis: the voxel one further up, or down.
  bool fromAbove(int axis) const { return sign_[axis] < 0; }

 private:
  static constexpr float kOpaqueVoxel = 1e7f;  ///< where light stays is told no more finely
  static constexpr int kOrder = 5;

  float depth_per_density_;
  float sign_[3], speed_[3];  ///< along the axes; 1 along that which the beam is nearest to
  /// Factors, by the axis of entry and the power of t, of phi_1 .. phi_5 = the means of
  /// exp(-tau t) (1 - t)^k / k!.
  float stays_[3][3][kOrder];

  /// How bright the beam is on a face by which it enters, over that where it is brightest.
  struct Entry {
    Row even;                  ///< what has passed the voxel before
    Row edges[3];              ///< by the axis along which it came into that one
    Row delay, delay_squared;  ///< means of t, t^2 that it has spent there
    VDB_DIFFUSE_INLINE Row sum() const { return even + (edges[0] + edges[1] + edges[2]); }
  };
  VDB_DIFFUSE_INLINE void enter(const Row before[3], Entry entries[3]) const;
};

template <typename Number>
VDB_DIFFUSE_INLINE Number BeamFaces::share(Number rho) const {
  Number x = (rho * depth_per_density_ - kThin) * (1 / (kThick - kThin));
  x = x > 0.0f ? x : Number{};
  x = x < 1.0f ? x : Number{} + 1.0f;
  return x * x * (3.0f - 2.0f * x);
}

VDB_DIFFUSE_INLINE void BeamFaces::enter(const Row before[3], Entry entries[3]) const {
  constexpr int kRounds = 3;            // each brings a factor of the thick voxels' mean transmittance
  constexpr float kSomething = 1e-20f;  // deep among opaque voxels no light comes, but it has a direction
  Row m[3], t[3], all[3];
  for (int b = 0; b < 3; ++b) {
    Row tau = before[b] * depth_per_density_;
    tau = tau < kOpaqueVoxel ? tau : Row{} + kOpaqueVoxel;
    const Attenuation passes = attenuationOf(tau);
    m[b] = all[b] = passes.m;
    t[b] = passes.m - passes.n;  // the mean of t exp(-tau t)
    entries[b] = {
        passes.e + kSomething, {}, t[b] / m[b], 1.0f + 2.0f * (nextOf(tau, passes.n) - passes.n) / m[b]};
  }
  for (int round = 0; round < kRounds; ++round)
    for (int b = 0; b < 3; ++b) {
      const int a = (b + 1) % 3, c = (b + 2) % 3;
      Entry& entry = entries[b];
      entry.edges[a] = (1.0f - entry.even) * speed_[a] * all[a] * (m[b] - speed_[c] * t[b]);
      entry.edges[c] = (1.0f - entry.even) * speed_[c] * all[c] * (m[b] - speed_[a] * t[b]);
      all[b] = entry.sum();
    }
  Row most = all[0] > all[1] ? all[0] : all[1];
  most = most > all[2] ? most : all[2];
  for (int b = 0; b < 3; ++b) {  // deep among opaque voxels floats would end
    entries[b].even /= most;
    for (Row& edge : entries[b].edges) edge /= most;
  }
}

VDB_DIFFUSE_INLINE BeamFaces::Moments BeamFaces::moments(Row rho, const Row before[3]) const {
  Row tau = rho * depth_per_density_;
  tau = tau > kThin ? tau : Row{} + kThin;  // in others nobody asks, and the recursion would lose digits
  tau = tau < kOpaqueVoxel ? tau : Row{} + kOpaqueVoxel;
  Row phi[kOrder];
  phi[0] = (1.0f - exponentialDecay(tau)) / tau;
  constexpr float kInverseFactorial[kOrder] = {1, 1, 1.0f / 2, 1.0f / 6, 1.0f / 24};
  for (int k = 1; k < kOrder; ++k) phi[k] = (kInverseFactorial[k] - phi[k - 1]) / tau;
  Entry entries[3];
  enter(before, entries);
  Moments sum{};
  Row light{};
  for (int b = 0; b < 3; ++b) {
    const Entry& entry = entries[b];
    Row mean[3]{};  // of 1, t, t^2
    for (int power = 0; power < 3; ++power)
      for (int k = 0; k < kOrder; ++k) mean[power] += stays_[b][power][k] * phi[k];
    const Row all = entry.sum();
    light += all * mean[0];
    const Row first = mean[1] + entry.delay * mean[0],
              second = mean[2] + 2.0f * entry.delay * mean[1] + entry.delay_squared * mean[0];
    for (int a = 0; a < 3; ++a) {
      const float s = speed_[a];
      if (a == b) {
        sum.lean[a] += entry.even * (s * mean[1] - 0.5f * mean[0]);
        sum.spread[a] += entry.even * ((1.0f / 6) * mean[0] + s * (s * mean[2] - mean[1]));
      } else {
        sum.lean[a] += entry.edges[a] * (s * first - 0.5f * mean[0]);
        sum.spread[a] += entry.edges[a] * ((1.0f / 6) * mean[0] + s * (s * second - first));
      }
    }
  }
  const Row scale = light > 0.0f ? 1.0f / light : Row{};
  for (int a = 0; a < 3; ++a) {
    sum.lean[a] *= scale * sign_[a];
    sum.spread[a] *= scale;
  }
  return sum;
}

/// Means of a beam over the voxels of a block, and of it times x and x^2 - 1/12, by axis.
struct BlockMoments {
  const float* light;
  float *lean[3], *spread[3];
};

/// Replaces the moments that rays have left of a beam, in thick voxels.
/// \param rho  with the voxels across the block's faces
void replaceMoments(const BeamFaces& faces, const Halo<float>& rho, const BlockMoments& block);
/// Adds those of light that has been left in thick voxels.
void addMoments(const BeamFaces& faces, const Halo<float>& rho, const BlockMoments& block);

}  // namespace vdb_diffuse
