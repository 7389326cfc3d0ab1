#include "diffusion/corner_light.h"

#include <algorithm>

#include "diffusion/beam_faces.h"
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

/// 0 where rays pass a voxel, 1 where they end in it.
double opacity(double tau) {
  const double x = (tau - BeamFaces::kThin) / (BeamFaces::kThick - BeamFaces::kThin);
  const double y = std::clamp(x, 0.0, 1.0);
  return y * y * (3 - 2 * y);
}

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
      inside.block(b)[n] = static_cast<float>(share) * all * least[n];
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
