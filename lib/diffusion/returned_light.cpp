#include "diffusion/returned_light.h"

#include <cmath>

#include "diffusion/area_factor.h"
#include "medium/attenuation.h"
#include "medium/turned_block.h"
#include "medium/wavefront.h"

namespace vdb_diffuse {
namespace {

constexpr int kProbeOrder = 4;  // 24 directions
constexpr double kMostReturned =
    0.98;  // beta; what is closed more tightly than that leaks by diffusion anyway

/// Voxels of a block whose face looks at one that is not active.
BlockMask openFaces(const Topology& topology, size_t b, int face) {
  const BlockMask& active = topology.active(b);
  const int32_t across = topology.neighbours(b)[face];
  const int axis = face / 2, up = face % 2, stride = 64 >> (3 * axis), shift = 6 - 3 * axis;
  BlockMask open;
  for (auto it = active.beginOn(); it; ++it) {
    const int n = static_cast<int>(it.pos());
    const bool edge = (n >> shift & 7) == (up ? 7 : 0);
    const bool next =
        edge ? across != kNoBlock && topology.active(across).isOn(up ? n - 7 * stride : n + 7 * stride)
             : active.isOn(up ? n + stride : n - stride);
    if (!next) open.setOn(n);
  }
  return open;
}

/// A block's outer faces, and what passes them.
struct Surface {
  const float* tau;
  const uint8_t* open[6];  ///< by Topology::Face, a byte for each row
  int stride_w, stride_u;
};

struct Passed {
  DoubleRow entering{}, leaving{};
};

VDB_DIFFUSE_KERNEL void passFaces(const RayLattice& lattice, const Surface& block, const Coord& origin,
                                  float* rays, Passed& passed) {
  const float share = static_cast<float>(lattice.weight * lattice.cross_section);
  const int axes[3] = {lattice.w, lattice.u, lattice.v};
  for (int n = 0; n < kBlockWidth; ++n) {
    const int w = lattice.sign > 0 ? n : kBlockWidth - 1 - n;
    const Layer& layer = lattice.layers[origin[lattice.w] + w - lattice.first_layer];
    for (int k = 0; k < layer.steps; ++k) {
      const LayerStep& step = layer.step[k];
      const int in = axes[step.entered_by], out = axes[step.left_by];
      const uint8_t *open_in = block.open[2 * in + (lattice.s[in] < 0 ? 1 : 0)],
                    *open_out = block.open[2 * out + (lattice.s[out] > 0 ? 1 : 0)];
      const float length = lattice.length * step.extent;
      float* ray = rays + lattice.place(origin[lattice.u] - step.shift_u, origin[lattice.v] - step.shift_v);
      Row entering{}, leaving{};
      for (int u = 0; u < kBlockWidth; ++u, ray += lattice.pitch) {
        const int at = w * block.stride_w + u * block.stride_u;
        const Row depth = loadRow(block.tau + at);
        if (!anyAbove0(depth)) continue;
        const Row psi = loadRow(ray), e = exponentialDecay(depth * length), after = psi * e + (1.0f - e);
        entering += rowMask(open_in[at >> 3]) ? psi : Row{};
        leaving += rowMask(open_out[at >> 3]) ? after : Row{};
        storeRow(ray, after);
      }
      passed.entering += widen(entering * share);
      passed.leaving += widen(leaving * share);
    }
  }
}

}  // namespace

std::vector<float> returnedLight(const Medium& medium, double extinction) {
  const Topology& topology = medium.topology();
  const double h = medium.transform().meanVoxelSize();
  const Vec3d stretch = medium.transform().voxelSize() / h;
  const Wavefront wavefront(medium.density.topology, stretch, levelSymmetric(kProbeOrder));

  struct Sums {
    double entering = 0, leaving = 0;
  };
  std::vector<Sums> sums(topology.blockCount());
  std::vector<float> factor(topology.blockCount(), 1.0f);
  for (int octant = 0; octant < Wavefront::kOctants; ++octant) {
    const std::vector<RayLattice>& lattices = wavefront.lattices(octant);
    wavefront.pass(octant, [&](size_t b, Wavefront::Rays& rays) {
      alignas(64) float tau[kBlockVoxels], turned_tau[kBlockVoxels];
      const float* rho = medium.density.values.block(b);
      for (int n = 0; n < kBlockVoxels; ++n) tau[n] = static_cast<float>(extinction * h * rho[n]);
      turnBlock(tau, turned_tau);
      const RowBits open[6] = {RowBits(openFaces(topology, b, 0)), RowBits(openFaces(topology, b, 1)),
                               RowBits(openFaces(topology, b, 2)), RowBits(openFaces(topology, b, 3)),
                               RowBits(openFaces(topology, b, 4)), RowBits(openFaces(topology, b, 5))};
      Surface plain{tau, {}, 64, 8}, turned{turned_tau, {}, 64, 8};
      for (int face = 0; face < 6; ++face) {
        plain.open[face] = open[face].plain;
        turned.open[face] = open[face].turned;
      }
      Passed passed;
      for (size_t d = 0; d < lattices.size(); ++d) {
        const RayLattice& lattice = lattices[d];
        plain.stride_w = lattice.w == 0 ? 64 : 8;
        plain.stride_u = lattice.w == 0 ? 8 : 64;
        passFaces(lattice, lattice.w == 2 ? turned : plain, topology.origin(b), rays[d].get(), passed);
      }
      sums[b].entering += sumOf(passed.entering);
      sums[b].leaving += sumOf(passed.leaving);
    });
  }
  forEachBlock(topology.blockCount(), [&](size_t b) {
    if (!(sums[b].leaving > 0)) return;
    float area[kBlockVoxels];
    areaFactors(topology, stretch, b, area);
    double faces = 0, area_sum = 0, tau_sum = 0;
    for (int face = 0; face < 6; ++face) {
      const BlockMask open = openFaces(topology, b, face);
      for (auto it = open.beginOn(); it; ++it) {
        ++faces;
        area_sum += area[it.pos()];
        tau_sum += extinction * h * medium.density.values.block(b)[it.pos()];
      }
    }
    if (faces == 0) return;
    const double a = area_sum / faces, tau = tau_sum / faces;
    const double beta = std::min(sums[b].entering / sums[b].leaving, kMostReturned);
    const double smooth = std::min(a, a / (2 - a) + (1 - a) / (1 + 1.5 * tau));
    factor[b] = static_cast<float>(std::min(1.0, (1 - beta) / (1 + beta) / smooth));
  });
  return factor;
}

}  // namespace vdb_diffuse
