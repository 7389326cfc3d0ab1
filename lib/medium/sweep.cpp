#include "medium/sweep.h"

#include <algorithm>
#include <numeric>

#include "medium/angular_basis.h"
#include "medium/attenuation.h"
#include "medium/turned_block.h"

namespace vdb_diffuse {
namespace {

/// A block's fields, rows addressed by their place along w and u. Slopes by axis of the grid.
struct BlockView {
  const float *tau, *J, *slope[3], *angular[kSecondOrder];
  float *mean, *divergence, *moments[kSecondOrder], *lean[3];
  int stride_w, stride_u;
};

/// Space for one block's turned copy.
struct alignas(64) TurnedCopy {
  float tau[kBlockVoxels], J[kBlockVoxels], slope[3][kBlockVoxels], angular[kSecondOrder][kBlockVoxels];
  float mean[kBlockVoxels], divergence[kBlockVoxels], moments[kSecondOrder][kBlockVoxels];
  float lean[3][kBlockVoxels];
};

template <int kAngular, int kMoments, bool kLean>
VDB_DIFFUSE_INLINE void passBlock(const RayLattice& lattice, const BlockView& block, const Coord& origin,
                                  Stretch part, float* rays) {
  double exact[kSecondOrder];
  float basis[kSecondOrder];
  angularBasis(lattice.s, exact);
  for (int k = 0; k < kSecondOrder; ++k) basis[k] = static_cast<float>(exact[k]);
  const float *slope_w = block.slope[lattice.w], *slope_u = block.slope[lattice.u],
              *slope_v = block.slope[lattice.v];
  float *const lean_w = block.lean[lattice.w], *const lean_u = block.lean[lattice.u],
               *const lean_v = block.lean[lattice.v];
  for (int n = 0; n < kBlockWidth; ++n) {
    const int w = lattice.sign > 0 ? n : kBlockWidth - 1 - n;
    const Layer& layer = lattice.layers[origin[lattice.w] + w - lattice.first_layer];
    for (int k = 0; k < layer.steps; ++k) {
      if (!part.has(n, k)) continue;
      const LayerStep& step = layer.step[k];
      const float length = lattice.length * step.extent;
      const float share = static_cast<float>(lattice.weight) * step.extent;
      float* ray = rays + lattice.place(origin[lattice.u] - step.shift_u, origin[lattice.v] - step.shift_v);
      for (int u = 0; u < kBlockWidth; ++u, ray += lattice.pitch) {
        const int at = w * block.stride_w + u * block.stride_u;
        const Row depth = loadRow(block.tau + at);
        if (!anyAbove0(depth)) continue;
        const Row tau = depth * length;
        const Attenuation light = attenuationOf(tau);
        const Row emits = tau * light.m,
                  leans = tau * light.n;  // 1 - e and 1 - m, to the last bit where thin
        const Row g_w = loadRow(slope_w + at), g_u = loadRow(slope_u + at), g_v = loadRow(slope_v + at);
        Row J = loadRow(block.J + at) + g_w * step.enters[0] + g_u * step.enters[1] + g_v * step.enters[2];
        for (int m = 0; m < kAngular; ++m) J += loadRow(block.angular[m] + at) * basis[m];
        const Row dJ = g_w * step.moves[0] + g_u * step.moves[1] + g_v * step.moves[2];
        const Row psi = loadRow(ray);
        const Row mean = (psi * light.m + J * leans + dJ * (0.5f - light.n)) * share;
        // not as the difference of what enters and leaves, large numbers both where voxels are thick
        const Row gain = depth * ((J - psi) * light.m + dJ * light.n) * share;
        storeRow(ray, psi * light.e + J * emits + dJ * leans);
        storeRow(block.mean + at, loadRow(block.mean + at) + mean);
        storeRow(block.divergence + at, loadRow(block.divergence + at) + gain);
        for (int m = 0; m < kMoments; ++m)
          storeRow(block.moments[m] + at, loadRow(block.moments[m] + at) + mean * basis[m]);
        if constexpr (kLean) {  // the mean times the place, which grows by `moves` along the step
          const Row p = nextOf(tau, light.n);
          const Row ahead =
              (psi * (light.m - light.n) + J * tau * (light.n - p) + dJ * (1.0f / 3 - light.n + p)) * share;
          const auto addLean = [&](float* lean, int axis) {
            storeRow(lean + at, loadRow(lean + at) + mean * step.enters[axis] + ahead * step.moves[axis]);
          };
          addLean(lean_w, 0);
          addLean(lean_u, 1);
          addLean(lean_v, 2);
        }
      }
    }
  }
}

using Pass = void(const RayLattice&, const BlockView&, const Coord&, Stretch, float*);
#define VDB_DIFFUSE_PASS(name, angular, moments, lean)                                             \
  VDB_DIFFUSE_KERNEL void name(const RayLattice& l, const BlockView& b, const Coord& o, Stretch p, \
                               float* r) {                                                         \
    passBlock<angular, moments, lean>(l, b, o, p, r);                                              \
  }
VDB_DIFFUSE_PASS(pass00, 0, 0, false)
VDB_DIFFUSE_PASS(pass03, 0, kFirstOrder, false)
VDB_DIFFUSE_PASS(pass33, kFirstOrder, kFirstOrder, false)
VDB_DIFFUSE_PASS(pass88, kSecondOrder, kSecondOrder, false)
VDB_DIFFUSE_PASS(pass00Lean, 0, 0, true)
VDB_DIFFUSE_PASS(pass03Lean, 0, kFirstOrder, true)
VDB_DIFFUSE_PASS(pass33Lean, kFirstOrder, kFirstOrder, true)
VDB_DIFFUSE_PASS(pass88Lean, kSecondOrder, kSecondOrder, true)
#undef VDB_DIFFUSE_PASS

Pass* passFor(size_t angular, size_t moments, bool lean) {
  if (angular > kFirstOrder) return lean ? pass88Lean : pass88;
  if (angular > 0) return lean ? pass33Lean : pass33;
  if (moments > 0) return lean ? pass03Lean : pass03;
  return lean ? pass00Lean : pass00;
}

/// A block's fields as they are and turned, and afterwards the sums of the turned copy added to its own.
class BlockFields {
 public:
  BlockFields(const SweepSource& source, SweepResult& result, size_t b) {
    in(source.tau, b, plain_.tau, turned_.tau, copy_.tau);
    in(source.J, b, plain_.J, turned_.J, copy_.J);
    for (int a = 0; a < 3; ++a) in(source.slope[a], b, plain_.slope[a], turned_.slope[a], copy_.slope[a]);
    for (size_t k = 0; k < source.angular.size(); ++k)
      in(source.angular[k], b, plain_.angular[k], turned_.angular[k], copy_.angular[k]);
    out(result.mean, b, plain_.mean, turned_.mean, copy_.mean);
    out(result.divergence, b, plain_.divergence, turned_.divergence, copy_.divergence);
    moments_ = result.moments.size();
    for (size_t k = 0; k < moments_; ++k)
      out(result.moments[k], b, plain_.moments[k], turned_.moments[k], copy_.moments[k]);
    lean_ = !result.slope[0].empty();
    for (int a = 0; lean_ && a < 3; ++a)
      out(result.slope[a], b, plain_.lean[a], turned_.lean[a], copy_.lean[a]);
    turned_.stride_w = 64;
    turned_.stride_u = 8;
  }
  const BlockView& along(const RayLattice& lattice) {
    if (lattice.w == 2) return turned_;
    plain_.stride_w = lattice.w == 0 ? 64 : 8;
    plain_.stride_u = lattice.w == 0 ? 8 : 64;
    return plain_;
  }
  void finish() {
    addTurnedBack(copy_.mean, plain_.mean);
    addTurnedBack(copy_.divergence, plain_.divergence);
    for (size_t k = 0; k < moments_; ++k) addTurnedBack(copy_.moments[k], plain_.moments[k]);
    for (int a = 0; lean_ && a < 3; ++a) addTurnedBack(copy_.lean[a], plain_.lean[a]);
  }

 private:
  BlockView plain_, turned_;
  TurnedCopy copy_;
  size_t moments_;
  bool lean_;

  static void in(const Field<float>& field, size_t b, const float*& plain, const float*& turned,
                 float* copy) {
    plain = field.block(b);
    turned = copy;
    turnBlock(plain, copy);
  }
  static void out(Field<float>& field, size_t b, float*& plain, float*& turned, float* copy) {
    plain = field.block(b);
    turned = copy;
    std::fill_n(copy, kBlockVoxels, 0.0f);
  }
};

/// From first moments to slopes: a line of slope 1 has the mean square of the places that rays meet in a
/// voxel, weighted as their directions are. A direction's depends on the voxel's coordinate along its axis w
/// alone.
///
/// The one or two rays of a direction lie to one side of the voxel's middle, but those of its mirror images
/// to the other, as all pass the middle of the volume: all together they are a sample of the voxel, and even
/// light has no slope. A direction by itself tells little of the slope across it: taken about each one's own
/// places, and fitted to the slopes of a sky at a surface, slopes were 0.91, 0.77, 0.62 and 0.64 of what they
/// are in the interior of a medium of 0.5, 1, 2 and 4 optical depths a voxel
/// (SweptSlopes.AreThoseOfTheDecay).
void slopesOfMoments(const Wavefront& wavefront, VectorField& lean) {
  const Topology& topology = wavefront.topology();
  std::vector<Vec3d> square[3];  // by axis w and coordinate, along the grid's axes
  for (int w = 0; w < 3; ++w) square[w].resize(topology.highest()[w] - topology.lowest()[w] + 1, Vec3d(0));
  for (int octant = 0; octant < Wavefront::kOctants; ++octant)
    for (const RayLattice& lattice : wavefront.lattices(octant)) {
      const int axes[3] = {lattice.w, lattice.u, lattice.v};
      for (size_t layer = 0; layer < lattice.layers.size(); ++layer)
        for (int a = 0; a < 3; ++a)
          square[lattice.w][layer][axes[a]] += lattice.weight * lattice.layers[layer].square[a];
    }
  forEachBlock(topology.blockCount(), [&](size_t b) {
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      const Coord place = topology.origin(b) + voxelLocal(n) - topology.lowest();
      const Vec3d sum = square[0][place[0]] + square[1][place[1]] + square[2][place[2]];
      for (int a = 0; a < 3; ++a) lean[a].block(b)[n] /= static_cast<float>(sum[a]);
    }
  });
}

}  // namespace

SweepResult sweep(const Wavefront& wavefront, const SweepSource& source, size_t moments, bool want_slope,
                  const Obstacles* obstacles) {
  const Topology& topology = wavefront.topology();
  SweepResult result;
  result.mean = Field<float>(topology);
  result.divergence = Field<float>(topology);
  for (size_t k = 0; k < std::max(moments, source.angular.size()); ++k) result.moments.emplace_back(topology);
  if (want_slope)
    for (Field<float>& component : result.slope) component = Field<float>(topology);
  Pass* const pass = passFor(source.angular.size(), result.moments.size(), want_slope);
  for (int octant = 0; octant < Wavefront::kOctants; ++octant) {
    const std::vector<RayLattice>& lattices = wavefront.lattices(octant);
    const auto passBlocks = [&](size_t b, const auto& passDirection) {
      BlockFields fields(source, result, b);
      for (size_t d = 0; d < lattices.size(); ++d)
        passDirection(d, [&](Stretch part, float* rays) {
          pass(lattices[d], fields.along(lattices[d]), topology.origin(b), part, rays);
        });
      fields.finish();
    };
    const Wavefront::Rays left = passObstructed(wavefront, octant, obstacles, result.escaped, passBlocks);
    for (size_t d = 0; d < lattices.size(); ++d)
      result.escaped += std::accumulate(left[d].get(), left[d].get() + lattices[d].rays(), 0.0) *
                        lattices[d].weight * lattices[d].cross_section;
  }
  if (want_slope && topology.blockCount() > 0) slopesOfMoments(wavefront, result.slope);
  return result;
}

}  // namespace vdb_diffuse
