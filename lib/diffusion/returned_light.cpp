#include "diffusion/returned_light.h"

#include <cmath>

#include "diffusion/area_factor.h"
#include "medium/attenuation.h"
#include "medium/turned_block.h"
#include "surfaces/surface_light.h"

namespace vdb_diffuse {
namespace {

/// Of the rays from the volume's middle, in voxels: through the middle itself they would meet the edges of
/// voxels, and rounding would decide which side they pass.
constexpr double kAside = 0.17;
constexpr float kMostReturned = 0.98f;  // what is closed more tightly than that leaks by diffusion anyway

/// Faces of a block's voxels beside voxels that are not active, with no wall between.
std::array<BlockMask, 6> openFaces(const Topology& topology, const Walls& walls, size_t b) {
  std::array<BlockMask, 6> open = topology.outerFaces(b);
  if (walls.empty()) return open;
  const auto list = walls.find(static_cast<int32_t>(b));
  if (list == walls.end()) return open;
  for (const WallFace& wall : list->second) open[wall.face].setOff(wall.voxel);
  return open;
}

/// A block's outer faces, and what passes them.
struct Faces {
  const float* tau;
  const uint8_t* open[6];  ///< by Topology::Face, a byte for each row
  float *entering, *leaving;
  int stride_w, stride_u;
};

VDB_DIFFUSE_KERNEL void passFaces(const RayLattice& lattice, const Faces& block, const Coord& origin,
                                  Stretch part, float* rays) {
  const float share = static_cast<float>(lattice.weight * lattice.cross_section);
  const int axes[3] = {lattice.w, lattice.u, lattice.v};
  for (int n = 0; n < kBlockWidth; ++n) {
    const int w = lattice.sign > 0 ? n : kBlockWidth - 1 - n;
    const Layer& layer = lattice.layers[origin[lattice.w] + w - lattice.first_layer];
    for (int k = 0; k < layer.steps; ++k) {
      if (!part.has(n, k)) continue;
      const LayerStep& step = layer.step[k];
      const int in = axes[step.entered_by], out = axes[step.left_by];
      const uint8_t *open_in = block.open[2 * in + (lattice.s[in] < 0 ? 1 : 0)],
                    *open_out = block.open[2 * out + (lattice.s[out] > 0 ? 1 : 0)];
      const float length = lattice.length * step.extent;
      float* ray = rays + lattice.place(origin[lattice.u] - step.shift_u, origin[lattice.v] - step.shift_v);
      for (int u = 0; u < kBlockWidth; ++u, ray += lattice.pitch) {
        const int at = w * block.stride_w + u * block.stride_u;
        const Row depth = loadRow(block.tau + at);
        if (!anyAbove0(depth)) continue;
        const Row psi = loadRow(ray), e = exponentialDecay(depth * length), after = psi * e + (1.0f - e);
        storeRow(ray, after);
        if (open_in[at >> 3])
          storeRow(block.entering + at,
                   loadRow(block.entering + at) + (rowMask(open_in[at >> 3]) ? psi * share : Row{}));
        if (open_out[at >> 3])
          storeRow(block.leaving + at,
                   loadRow(block.leaving + at) + (rowMask(open_out[at >> 3]) ? after * share : Row{}));
      }
    }
  }
}

/// Light through the outer faces of every voxel.
struct FaceLight {
  Field<float> entering, leaving;
};

/// Optical depths of a block's voxels.
void depthsOf(const ChannelOptics& optics, const Medium& medium, size_t b, float* tau) {
  const float* rho = medium.density.values.block(b);
  const double h = medium.transform().meanVoxelSize();
  const double usual = optics.sigma_t_beam * h;
  for (int n = 0; n < kBlockVoxels; ++n)
    tau[n] = static_cast<float>((optics.albedo_field ? optics.at(b, n).sigma_t_beam * h : usual) * rho[n]);
}

/// The light where the whole medium glows with a source function of 1.
FaceLight lightThroughFaces(const Wavefront& wavefront, const Medium& medium, const Walls& walls,
                            const ChannelOptics& optics, const Obstacles* obstacles) {
  const Topology& topology = medium.topology();
  FaceLight light{Field<float>(topology), Field<float>(topology)};
  for (int octant = 0; octant < Wavefront::kOctants; ++octant) {
    const std::vector<RayLattice>& lattices = wavefront.lattices(octant);
    double taken = 0;
    passObstructed(wavefront, octant, obstacles, taken, [&](size_t b, const auto& passDirection) {
      alignas(64) float tau[kBlockVoxels], turned_tau[kBlockVoxels], entering[kBlockVoxels],
          leaving[kBlockVoxels];
      depthsOf(optics, medium, b, tau);
      turnBlock(tau, turned_tau);
      std::fill_n(entering, kBlockVoxels, 0.0f);
      std::fill_n(leaving, kBlockVoxels, 0.0f);
      const std::array<BlockMask, 6> masks = openFaces(topology, walls, b);
      const RowBits open[6] = {RowBits(masks[0]), RowBits(masks[1]), RowBits(masks[2]),
                               RowBits(masks[3]), RowBits(masks[4]), RowBits(masks[5])};
      Faces plain{tau, {}, light.entering.block(b), light.leaving.block(b), 64, 8};
      Faces turned{turned_tau, {}, entering, leaving, 64, 8};
      for (int face = 0; face < 6; ++face) {
        plain.open[face] = open[face].plain;
        turned.open[face] = open[face].turned;
      }
      for (size_t d = 0; d < lattices.size(); ++d) {
        plain.stride_w = lattices[d].w == 0 ? 64 : 8;
        plain.stride_u = lattices[d].w == 0 ? 8 : 64;
        passDirection(d, [&](Stretch part, float* rays) {
          passFaces(lattices[d], lattices[d].w == 2 ? turned : plain, topology.origin(b), part, rays);
        });
      }
      addTurnedBack(entering, plain.entering);
      addTurnedBack(leaving, plain.leaving);
    });
  }
  return light;
}

constexpr int kReach = 4;  // of the ball over which light is summed, voxels
constexpr int kSpan = kBlockWidth + 2 * kReach;

/// The ball's half length along z, (dx, dy) from its middle; -1: outside.
struct BallChords {
  int reach[2 * kReach + 1][2 * kReach + 1] = {};
  constexpr BallChords() {
    for (int dx = -kReach; dx <= kReach; ++dx)
      for (int dy = -kReach; dy <= kReach; ++dy) {
        int z = -1;
        while (dx * dx + dy * dy + (z + 1) * (z + 1) <= kReach * kReach) ++z;
        reach[dx + kReach][dy + kReach] = z;
      }
  }
};
constexpr BallChords kChords;

/// Sums of a field along z, from the bottom of the halo up: [x][y][z] holds the sum of what lies below z.
struct RunningSums {
  float sum[kSpan][kSpan][kSpan + 1];

  VDB_DIFFUSE_INLINE RunningSums(const Topology& topology, const Field<float>& field, size_t block) {
    const Coord& origin = topology.origin(block);
    std::fill_n(&sum[0][0][0], kSpan * kSpan * (kSpan + 1), 0.0f);
    for (int bx = -1; bx <= 1; ++bx)
      for (int by = -1; by <= 1; ++by)
        for (int bz = -1; bz <= 1; ++bz) {
          const int32_t b = topology.find(origin + Coord(8 * bx, 8 * by, 8 * bz));
          if (b == kNoBlock) continue;
          const float* values = field.block(b);
          const auto first = [](int side) { return std::max(0, 8 * side + kReach); };
          const auto end = [](int side) { return std::min(kSpan, 8 * side + kReach + 8); };
          for (int x = first(bx); x < end(bx); ++x)
            for (int y = first(by); y < end(by); ++y)
              std::copy_n(values + voxelOffset((x - kReach) & 7, (y - kReach) & 7, (first(bz) - kReach) & 7),
                          end(bz) - first(bz), &sum[x][y][first(bz) + 1]);
        }
    for (auto& plane : sum)
      for (auto& row : plane)
        for (int z = 0; z < kSpan; ++z) row[z + 1] += row[z];
  }
  /// Over the ball about eight voxels along z, (x, y) of the block.
  VDB_DIFFUSE_INLINE Row ball(int x, int y) const {
    Row total{};
    for (int dx = -kReach; dx <= kReach; ++dx)
      for (int dy = -kReach; dy <= kReach; ++dy) {
        const int reach = kChords.reach[dx + kReach][dy + kReach];
        if (reach < 0) continue;
        const float* row = sum[x + kReach + dx][y + kReach + dy] + kReach;
        total += loadRow(row + reach + 1) - loadRow(row - reach);
      }
    return total;
  }
};

/// \param smooth   what x would be by the steps of a smooth surface, times the light that leaves
/// \param surface  voxels with open faces
VDB_DIFFUSE_KERNEL void factorsOfBlock(const Topology& topology, const FaceLight& light,
                                       const Field<float>& smooth, const BlockMask& surface, size_t b,
                                       float* factor) {
  const RunningSums entering(topology, light.entering, b), leaving(topology, light.leaving, b),
      smooth_sum(topology, smooth, b);
  for (int row = 0; row < 64; ++row) {
    const uint8_t bits = rowBits(surface)[row];
    if (!bits) continue;
    const int x = row >> 3, y = row & 7;
    const Row in = entering.ball(x, y), out = leaving.ball(x, y), m = smooth_sum.ball(x, y);
    for (int z = 0; z < 8; ++z) {
      if (!(bits >> z & 1) || !(out[z] > 0 && m[z] > 0)) continue;
      const float beta = std::clamp(in[z] / out[z], 0.0f, kMostReturned);
      factor[row * 8 + z] = std::min(1.0f, (1 - beta) / (1 + beta) * out[z] / m[z]);
    }
  }
}

}  // namespace

ReturnedLight::ReturnedLight(const Medium& medium, const Occluder& occluder,
                             const std::vector<Surface>& surfaces, const Walls& walls)
    : medium_(medium),
      surfaces_(surfaces),
      walls_(walls),
      stretch_(medium.transform().voxelSize() / medium.transform().meanVoxelSize()),
      wavefront_(medium.density.topology, stretch_, offPlanes(), kAside),
      cuts_(findSurfaceCuts(wavefront_, medium.transform(), occluder, surfaces)) {}

Field<float> ReturnedLight::factors(const ChannelOptics& optics, int channel) const {
  const Topology& topology = medium_.topology();
  Field<float> factor(topology, 1.0f);
  if (topology.blockCount() == 0) return factor;
  const auto probe = [&](const Obstacles* obstacles) {
    return lightThroughFaces(wavefront_, medium_, walls_, optics, obstacles);
  };
  FaceLight light;
  if (cuts_.empty()) {
    light = probe(nullptr);
  } else {
    SurfaceLight surfaces(wavefront_, cuts_, surfaces_, channel);
    const Obstacles obstacles = surfaces.obstacles();
    light = probe(&obstacles);
    if (surfaces.reflects()) {
      surfaces.turn();
      light = probe(&obstacles);
    }
  }

  Field<float> smooth(topology);
  forEachBlock(topology.blockCount(), [&](size_t b) {
    float area[kBlockVoxels], tau[kBlockVoxels];
    areaFactors(topology, stretch_, b, area);
    depthsOf(optics, medium_, b, tau);
    const float* leaving = light.leaving.block(b);
    for (int n = 0; n < kBlockVoxels; ++n) {
      const float a = area[n];
      smooth.block(b)[n] = leaving[n] * std::min(a, a / (2 - a) + (1 - a) / (1 + 1.5f * tau[n]));
    }
  });
  forEachBlock(topology.blockCount(), [&](size_t b) {
    BlockMask surface;
    for (const BlockMask& open : openFaces(topology, walls_, b)) surface |= open;
    if (surface.isOff()) return;
    factorsOfBlock(topology, light, smooth, surface, b, factor.block(b));
  });
  return factor;
}

}  // namespace vdb_diffuse
