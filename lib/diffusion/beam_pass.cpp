#include "diffusion/beam_pass.h"

#include <algorithm>

#include "medium/attenuation.h"
#include "medium/turned_block.h"

namespace vdb_diffuse {
namespace {

constexpr float kGone = 1e-30f;  // light of 1 that has come down to this is none: no denormal numbers

/// What becomes of a ray that enters a segment with light 1: `left` of it leaves, and the means over the
/// segment of the light times 1, t and t^2 are m0, m1 and m2, t = 0..1 along it.
struct Segment {
  Row left, m0, m1, m2;
};

VDB_DIFFUSE_INLINE Segment segmentOf(Row tau) {
  const Attenuation light = attenuationOf(tau);
  const Row p = nextOf(tau, light.n);
  return {light.e, light.m, light.m - light.n, light.m + 2.0f * (p - light.n)};
}

/// The same without the moments.
VDB_DIFFUSE_INLINE Segment plainSegmentOf(Row tau) {
  constexpr float kSmall = 0.7f;  // below, the series leaves out less than 2e-7
  const Row series =
      1.0f -
      tau * (1.0f / 2 -
             tau * (1.0f / 6 -
                    tau * (1.0f / 24 -
                           tau * (1.0f / 120 - tau * (1.0f / 720 - tau * (1.0f / 5040 - tau / 40320))))));
  Segment thin;
  thin.left = 1.0f - tau * series;
  thin.m0 = series;
  const RowMask thick = tau >= kSmall;
  if (!anyOf(thick)) return thin;
  const Row e = exponentialDecay(tau);
  thin.left = thick ? e : thin.left;
  thin.m0 = thick ? (1.0f - e) / tau : thin.m0;
  return thin;
}

VDB_DIFFUSE_INLINE void addRow(float* to, Row row) {
  storeRow(to, loadRow(to) + row);
}

template <bool kShape>
VDB_DIFFUSE_INLINE void passRows(const RayLattice& lattice, const BeamBlock& block, float extinction,
                                 float share, const LayerPlaces* moments, float* rays, BeamMarks& marks) {
  for (int n = 0; n < kBlockWidth; ++n) {
    const int w = lattice.sign > 0 ? n : kBlockWidth - 1 - n;
    const int number = block.origin[lattice.w] + w - lattice.first_layer;
    const Layer& layer = lattice.layers[number];
    for (int k = 0; k < layer.steps; ++k) {
      const LayerStep& step = layer.step[k];
      const float length = extinction * lattice.length * step.extent, extent = share * step.extent;
      float lean[3][2], spread[3][3];  // factors of the segment's means
      if constexpr (kShape)
        for (int a = 0; a < 3; ++a) {
          const LayerPlaces& even = moments[number];
          const float x = step.enters[a], dx = step.moves[a];
          lean[a][0] = even.stretch[a] * (x - even.centre[a]);
          lean[a][1] = even.stretch[a] * dx;
          spread[a][0] = x * x - even.square[a];
          spread[a][1] = 2 * x * dx;
          spread[a][2] = dx * dx;
        }
      float* ray = rays + lattice.place(block.origin[lattice.u] - step.shift_u,
                                        block.origin[lattice.v] - step.shift_v);
      for (int u = 0; u < kBlockWidth; ++u, ray += lattice.pitch) {
        const int at = w * block.stride_w + u * block.stride_u;
        if (!block.active[at >> 3]) continue;
        const Row psi = loadRow(ray);
        if (!anyAbove0(psi)) continue;
        const Row tau = loadRow(block.rho + at) * length, light = psi * extent;
        Segment segment;
        if constexpr (kShape) {
          segment = segmentOf(tau);
          const Row l0 = light * segment.m0, l1 = light * segment.m1, l2 = light * segment.m2;
          for (int a = 0; a < 3; ++a) {
            addRow(marks.lean[a] + at, l0 * lean[a][0] + l1 * lean[a][1]);
            addRow(marks.spread[a] + at, l0 * spread[a][0] + l1 * spread[a][1] + l2 * spread[a][2]);
          }
        } else {
          segment = plainSegmentOf(tau);
        }
        addRow(marks.light + at, light * segment.m0);
        const Row left = psi * segment.left;
        storeRow(ray, left > kGone ? left : Row{});
      }
    }
  }
}

VDB_DIFFUSE_KERNEL void passPlain(const RayLattice& lattice, const BeamBlock& block, float extinction,
                                  float share, float* rays, BeamMarks& marks) {
  passRows<false>(lattice, block, extinction, share, nullptr, rays, marks);
}
VDB_DIFFUSE_KERNEL void passShaped(const RayLattice& lattice, const BeamBlock& block, float extinction,
                                   float share, const LayerPlaces* moments, float* rays, BeamMarks& marks) {
  passRows<true>(lattice, block, extinction, share, moments, rays, marks);
}

}  // namespace

std::vector<LayerPlaces> layerPlaces(const std::vector<const RayLattice*>& lattices) {
  constexpr double kMostStretch = 4;
  std::vector<LayerPlaces> moments(lattices.front()->layers.size());
  for (size_t n = 0; n < moments.size(); ++n)
    for (int a = 0; a < 3; ++a) {
      double centre = 0, square = 0;
      for (const RayLattice* lattice : lattices) {
        const Layer& layer = lattice->layers[n];
        centre += layer.centre[a];
        square += layer.variance[a] + double{layer.centre[a]} * layer.centre[a];
      }
      centre /= static_cast<double>(lattices.size());
      square /= static_cast<double>(lattices.size());
      const double variance = square - centre * centre;
      moments[n].centre[a] = static_cast<float>(centre);
      moments[n].square[a] = static_cast<float>(square);
      moments[n].stretch[a] =
          static_cast<float>(12 * kMostStretch * variance > 1 ? 1. / 12 / variance : kMostStretch);
    }
  return moments;
}

void BeamMarks::clear(bool with_shape) {
  std::fill_n(light, kBlockVoxels, 0.0f);
  if (!with_shape) return;
  std::fill_n(lean[0], 3 * kBlockVoxels, 0.0f);
  std::fill_n(spread[0], 3 * kBlockVoxels, 0.0f);
}

void passBeam(const RayLattice& lattice, const BeamBlock& block, double extinction, double share,
              const std::vector<LayerPlaces>* moments, float* rays, BeamMarks& marks) {
  if (moments)
    passShaped(lattice, block, static_cast<float>(extinction), static_cast<float>(share), moments->data(),
               rays, marks);
  else
    passPlain(lattice, block, static_cast<float>(extinction), static_cast<float>(share), rays, marks);
}

}  // namespace vdb_diffuse
