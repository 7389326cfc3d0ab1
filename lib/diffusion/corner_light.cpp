#include "diffusion/corner_light.h"

#include <algorithm>

#include "multigrid/block_kernel.h"

namespace vdb_diffuse {
namespace {

struct Sum {
  VDB_DIFFUSE_INLINE Row operator()(Row a, Row b) const { return a + b; }
};
struct Least {
  VDB_DIFFUSE_INLINE Row operator()(Row a, Row b) const { return a < b ? a : b; }
};

/// Over the six neighbours of every voxel of a block; what is not active counts as 0.
template <typename Fold>
VDB_DIFFUSE_INLINE void foldAround(const Topology& topology, const Field<float>& field, size_t b,
                                   const Fold& fold, float* result) {
  Halo<float> f;
  loadHalo(topology, field, b, 0.0f, f);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      const Row own = loadRow(f.row(x, y));
      const Row across = fold(fold(loadRow(f.row(x - 1, y)), loadRow(f.row(x + 1, y))),
                              fold(loadRow(f.row(x, y - 1)), loadRow(f.row(x, y + 1))));
      const Row along = fold(shiftedUp(own, f.below[x][y]), shiftedDown(own, f.above[x][y]));
      storeRow(result + voxelOffset(x, y, 0), fold(across, along));
    }
}
VDB_DIFFUSE_KERNEL void sumsAround(const Topology& topology, const Field<float>& field, size_t b,
                                   float* sums) {
  foldAround(topology, field, b, Sum(), sums);
}
VDB_DIFFUSE_KERNEL void leastAround(const Topology& topology, const Field<float>& field, size_t b,
                                    float* least) {
  foldAround(topology, field, b, Least(), least);
}

/// Optical depths of a voxel that rays pass, and of one that they end in.
constexpr double kPassed = 1, kOpaque = 5;
double opacity(double tau) {
  const double x = std::clamp((tau - kPassed) / (kOpaque - kPassed), 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

/// Of the corners' light. What has crossed one is a little deeper below the surface, and a part of it does
/// stay: of balls of 3, 5, 7, 10, 20 optical depths a voxel under an oblique sun diffusion is 4.7, 3.1, 6.3,
/// 8.0, 9.2 % off with 0.65, 4.3, 4.6, 7.1, 8.2, 8.9 % with 0.75; with all of it 8.5, 10.6, 10.9 % of 5, 7,
/// 10, and with none 16 % of 10. Under a sky a ball of 10 is 5.5, 4.2, 1.2, 13.8 % off.
constexpr float kGathered = 0.7f;

}  // namespace

Field<float> gatherCornerLight(const Equation& e, const Medium& medium, const BeamSource& beams,
                               double share) {
  const Topology& topology = medium.topology();
  const auto forEachVoxel = [&](const auto& visit) {
    forEachBlock(topology.blockCount(), [&](size_t b) {
      const auto visitor = visit(b);
      for (auto it = topology.active(b).beginOn(); it; ++it) visitor(static_cast<int>(it.pos()));
    });
  };
  const auto scattered = [&](size_t b, int n) {
    const double tau_s = e.optics.at(b, n).source_sigma * e.h * beams.scale;
    return static_cast<float>(tau_s * medium.density.values.block(b)[n] * beams.Q0->block(b)[n]);
  };
  Field<float> opaque(topology), surface(topology), inside(topology), factor(topology, 1.0f);
  forEachVoxel([&](size_t b) {
    return [&, b, rho = medium.density.values.block(b)](int n) {
      opaque.block(b)[n] = static_cast<float>(opacity(e.optics.at(b, n).sigma_t_beam * e.h * rho[n]));
    };
  });
  // What scatters in opaque voxels: of those at a surface, and of those among their like.
  forEachVoxel([&](size_t b) {
    std::array<float, kBlockVoxels> least;
    leastAround(topology, opaque, b, least.data());
    return [&, b, least](int n) {
      const float all = opaque.block(b)[n] * scattered(b, n);
      inside.block(b)[n] = kGathered * static_cast<float>(share) * all * least[n];
      surface.block(b)[n] = all * (1 - least[n]);
    };
  });
  // Voxels inside give theirs to those about them, in proportion; `inside` becomes how much of each.
  forEachVoxel([&](size_t b) {
    std::array<float, kBlockVoxels> lit;
    sumsAround(topology, surface, b, lit.data());
    return [&, b, lit](int n) {
      float& given = inside.block(b)[n];
      if (!(given > 0)) return;
      if (!(lit[n] > 0)) {
        given = 0;
        return;
      }
      factor.block(b)[n] -= given / scattered(b, n);
      given /= lit[n];
    };
  });
  forEachVoxel([&](size_t b) {
    std::array<float, kBlockVoxels> taken;
    sumsAround(topology, inside, b, taken.data());
    return [&, b, taken](int n) {
      if (surface.block(b)[n] > 0) factor.block(b)[n] += taken[n] * surface.block(b)[n] / scattered(b, n);
    };
  });
  return factor;
}

}  // namespace vdb_diffuse
