#include "diffusion/beam_pass.h"

#include <algorithm>
#include <limits>

#include "medium/attenuation.h"
#include "medium/turned_block.h"

namespace vdb_diffuse {
namespace {

constexpr float kGone = std::numeric_limits<float>::min();  // denormal numbers would be slow

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
      float lean[3][2], spread[3][3];  // factors of the light's means times 1, t, t^2
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
        const Attenuation segment = attenuationOf(tau);
        const Row mean = light * segment.m;
        addRow(marks.light + at, mean);
        if constexpr (kShape) {
          const Row p = nextOf(tau, segment.n);  // means of the light times t and t^2, t = 0..1 on the way
          const Row first = light * (segment.m - segment.n), second = mean + light * 2.0f * (p - segment.n);
          for (int a = 0; a < 3; ++a) {
            addRow(marks.lean[a] + at, mean * lean[a][0] + first * lean[a][1]);
            addRow(marks.spread[a] + at, mean * spread[a][0] + first * spread[a][1] + second * spread[a][2]);
          }
        }
        const Row left = psi * segment.e;
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
        square += layer.square[a];
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
