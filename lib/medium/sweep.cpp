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
  float *mean, *divergence, *moments[kSecondOrder];
  int stride_w, stride_u;
};

/// Space for one block's turned copy.
struct alignas(64) TurnedCopy {
  float tau[kBlockVoxels], J[kBlockVoxels], slope[3][kBlockVoxels], angular[kSecondOrder][kBlockVoxels];
  float mean[kBlockVoxels], divergence[kBlockVoxels], moments[kSecondOrder][kBlockVoxels];
};

template <int kAngular, int kMoments>
VDB_DIFFUSE_INLINE void passBlock(const RayLattice& lattice, const BlockView& block, const Coord& origin,
                                  Stretch part, float* rays) {
  double exact[kSecondOrder];
  float basis[kSecondOrder];
  angularBasis(lattice.s, exact);
  for (int k = 0; k < kSecondOrder; ++k) basis[k] = static_cast<float>(exact[k]);
  const float *slope_w = block.slope[lattice.w], *slope_u = block.slope[lattice.u],
              *slope_v = block.slope[lattice.v];
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
        const Attenuation light = attenuationOf(depth * length);
        const Row g_w = loadRow(slope_w + at), g_u = loadRow(slope_u + at), g_v = loadRow(slope_v + at);
        Row J = loadRow(block.J + at) + g_w * step.enters[0] + g_u * step.enters[1] + g_v * step.enters[2];
        for (int m = 0; m < kAngular; ++m) J += loadRow(block.angular[m] + at) * basis[m];
        const Row dJ = g_w * step.moves[0] + g_u * step.moves[1] + g_v * step.moves[2];
        const Row psi = loadRow(ray);
        const Row mean = (psi * light.m + J * (1.0f - light.m) + dJ * (0.5f - light.n)) * share;
        // not as the difference of what enters and leaves, large numbers both where voxels are thick
        const Row gain = depth * ((J - psi) * light.m + dJ * light.n) * share;
        storeRow(ray, psi * light.e + J * (1.0f - light.e) + dJ * (1.0f - light.m));
        storeRow(block.mean + at, loadRow(block.mean + at) + mean);
        storeRow(block.divergence + at, loadRow(block.divergence + at) + gain);
        for (int m = 0; m < kMoments; ++m)
          storeRow(block.moments[m] + at, loadRow(block.moments[m] + at) + mean * basis[m]);
      }
    }
  }
}

using Pass = void(const RayLattice&, const BlockView&, const Coord&, Stretch, float*);
VDB_DIFFUSE_KERNEL void pass00(const RayLattice& l, const BlockView& b, const Coord& o, Stretch p, float* r) {
  passBlock<0, 0>(l, b, o, p, r);
}
VDB_DIFFUSE_KERNEL void pass03(const RayLattice& l, const BlockView& b, const Coord& o, Stretch p, float* r) {
  passBlock<0, kFirstOrder>(l, b, o, p, r);
}
VDB_DIFFUSE_KERNEL void pass33(const RayLattice& l, const BlockView& b, const Coord& o, Stretch p, float* r) {
  passBlock<kFirstOrder, kFirstOrder>(l, b, o, p, r);
}
VDB_DIFFUSE_KERNEL void pass88(const RayLattice& l, const BlockView& b, const Coord& o, Stretch p, float* r) {
  passBlock<kSecondOrder, kSecondOrder>(l, b, o, p, r);
}

Pass* passFor(size_t angular, size_t moments) {
  if (angular > kFirstOrder) return pass88;
  if (angular > 0) return pass33;
  return moments > 0 ? pass03 : pass00;
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
  }

 private:
  BlockView plain_, turned_;
  TurnedCopy copy_;
  size_t moments_;

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

}  // namespace

SweepResult sweep(const Wavefront& wavefront, const SweepSource& source, size_t moments,
                  const Obstacles* obstacles) {
  const Topology& topology = wavefront.topology();
  SweepResult result;
  result.mean = Field<float>(topology);
  result.divergence = Field<float>(topology);
  for (size_t k = 0; k < std::max(moments, source.angular.size()); ++k) result.moments.emplace_back(topology);
  Pass* const pass = passFor(source.angular.size(), result.moments.size());
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
  return result;
}

}  // namespace vdb_diffuse
