#include "diffusion/face_probe.h"

#include <cmath>
#include <cstring>

#include "medium/attenuation.h"
#include "medium/turned_block.h"

namespace vdb_diffuse {
namespace {

/// Of the rays from the volume's middle, in voxels: through the middle itself they would meet the edges of
/// voxels, and rounding would decide which side they pass.
constexpr double kAside = 0.17;

/// A mask's rows by layer across x, y and z, the rows of one layer in one word.
void rowsByLayer(const BlockMask& mask, uint64_t rows[3][kBlockWidth]) {
  const RowBits bits(mask);
  uint8_t across[kBlockVoxels / 8];
  for (int x = 0; x < kBlockWidth; ++x)
    for (int y = 0; y < kBlockWidth; ++y) across[y * kBlockWidth + x] = bits.plain[x * kBlockWidth + y];
  std::memcpy(rows[0], bits.plain, sizeof bits.plain);
  std::memcpy(rows[1], across, sizeof across);
  std::memcpy(rows[2], bits.turned, sizeof bits.turned);
}

/// A block in one of its two layouts: its optical depths, and which of its faces are open.
struct BlockView {
  const float* tau;
  const uint64_t* open[6];  ///< by Topology::Face; of each layer on the rays' way, a byte for each row
  int stride_w, stride_u;

  void layFor(int w, const uint64_t masks[6][3][kBlockWidth]) {
    stride_w = w == 1 ? 8 : 64;
    stride_u = w == 1 ? 64 : 8;
    for (int face = 0; face < 6; ++face) open[face] = masks[face][w];
  }
};

/// One step of a direction's rays through a layer of voxels, eight rows of eight.
struct RayStep {
  uint64_t open_in, open_out;  ///< of the faces that the rays enter and leave by
  int out;                     ///< axis that they leave along
  float length;                ///< in mean voxel sizes
  int first;                   ///< offset of the layer in the block
  float* rays;
};

template <typename Visit>
VDB_DIFFUSE_INLINE void forEachStep(const RayLattice& lattice, const BlockView& block, const Coord& origin,
                                    Stretch part, float* rays, const Visit& visit) {
  const int axes[3] = {lattice.w, lattice.u, lattice.v};
  for (int n = 0; n < kBlockWidth; ++n) {
    const int w = lattice.sign > 0 ? n : kBlockWidth - 1 - n;
    const Layer& layer = lattice.layers[origin[lattice.w] + w - lattice.first_layer];
    for (int k = 0; k < layer.steps; ++k) {
      if (!part.has(n, k)) continue;
      const LayerStep& step = layer.step[k];
      const int in = axes[step.entered_by], out = axes[step.left_by];
      visit(
          RayStep{block.open[2 * in + (lattice.s[in] < 0 ? 1 : 0)][w],
                  block.open[2 * out + (lattice.s[out] > 0 ? 1 : 0)][w], out, lattice.length * step.extent,
                  w * block.stride_w,
                  rays + lattice.place(origin[lattice.u] - step.shift_u, origin[lattice.v] - step.shift_v)});
    }
  }
}

/// The bits of row u of a layer.
VDB_DIFFUSE_INLINE RowMask rowOfLayer(uint64_t open, int u) {
  return rowMask(static_cast<uint8_t>(open >> 8 * u));
}

/// The light of a medium that glows with a source function of 1, at an optical depth after the dark.
VDB_DIFFUSE_INLINE Row glow(Row tau) {
  return 1.0f - exponentialDecay(tau);
}

/// Adds a layer's light through its open faces, those of active vacuum too: of a cloud with an eighth of such
/// voxels, diffusion is 7.8 % off Monte Carlo (RMS by density, 4^3 blocks); with their faces left out, 17 %.
/// \param tau  behind the rays, by row of voxels
VDB_DIFFUSE_INLINE void addLight(uint64_t open, const Row* tau, float share, float* light, int stride) {
  while (open) {
    const int u = __builtin_ctzll(open) / 8;
    const RowMask lanes = rowOfLayer(open, u);
    open &= ~(uint64_t(0xff) << 8 * u);
    float* row = light + u * stride;
    storeRow(row, loadRow(row) + (lanes ? glow(tau[u]) * share : Row{}));
  }
}

/// What stands in the way of rays that carry the optical depth behind them: surfaces take the light there,
/// and send on rays with the depth that would have glowed as they do.
Obstacles forDepths(const Obstacles& obstacles) {
  static constexpr float kBrightest = 1 - 0x1p-20f;  // nothing is brighter than what lights it
  return {obstacles.cuts,
          [&obstacles](int octant) {
            CutLight light = obstacles.leaving(octant);
            for (std::vector<float>& slots : light)
              for (float& slot : slots) slot = -std::log1p(-std::min(slot, kBrightest));
            return light;
          },
          [&obstacles](int octant, const CutLight& depths) {
            CutLight light = depths;
            for (std::vector<float>& slots : light)
              for (float& slot : slots) slot = -std::expm1(-slot);
            obstacles.arrived(octant, light);
          }};
}

/// Where all glows alike, a ray needs to know only the optical depth behind it: its light is asked for at the
/// outer faces alone.
VDB_DIFFUSE_KERNEL void passDepths(const RayLattice& lattice, const BlockView& block, const Coord& origin,
                                   Stretch part, float* rays, float* entering, float* leaving) {
  const float share = static_cast<float>(lattice.weight * lattice.cross_section);
  forEachStep(lattice, block, origin, part, rays, [&](const RayStep& step) VDB_DIFFUSE_INLINED {
    Row before[kBlockWidth], after[kBlockWidth];
    float* ray = step.rays;
    for (int u = 0; u < kBlockWidth; ++u, ray += lattice.pitch) {
      before[u] = loadRow(ray);
      after[u] = before[u] + loadRow(block.tau + step.first + u * block.stride_u) * step.length;
      storeRow(ray, after[u]);
    }
    addLight(step.open_in, before, share, entering + step.first, block.stride_u);
    addLight(step.open_out, after, share, leaving + step.first, block.stride_u);
  });
}

/// A block's sources in one of its layouts.
struct BlockSources {
  const float* S;
  const float* leaving[3];  ///< by the axis of the face
};

VDB_DIFFUSE_KERNEL void passLight(const RayLattice& lattice, const BlockView& block,
                                  const BlockSources& sources, const Coord& origin, Stretch part, float* rays,
                                  float* entering) {
  const float share = static_cast<float>(lattice.weight * lattice.cross_section);
  forEachStep(lattice, block, origin, part, rays, [&](const RayStep& step) VDB_DIFFUSE_INLINED {
    float* ray = step.rays;
    for (int u = 0; u < kBlockWidth; ++u, ray += lattice.pitch) {
      const int at = step.first + u * block.stride_u;
      const Row before = loadRow(ray);
      const Row passed = exponentialDecay(loadRow(block.tau + at) * step.length);
      Row source = loadRow(sources.S + at);
      if (step.open_out) {
        source = rowOfLayer(step.open_out, u) ? loadRow(sources.leaving[step.out] + at) : source;
      }
      storeRow(ray, source + passed * (before - source));
      if (step.open_in) {
        const Row enters = rowOfLayer(step.open_in, u) ? before * share : Row{};
        storeRow(entering + at, loadRow(entering + at) + enters);
      }
    }
  });
}

/// A block's outer faces by layer, in both layouts.
void layersOf(const std::array<BlockMask, 6>& faces, uint64_t open[6][3][kBlockWidth]) {
  for (int face = 0; face < 6; ++face) rowsByLayer(faces[face], open[face]);
}

}  // namespace

FaceProbe::FaceProbe(const Medium& medium, const Occluder& occluder, const std::vector<Surface>& surfaces,
                     const Walls& walls, const DirectionSet& directions)
    : medium_(medium),
      surfaces_(surfaces),
      walls_(walls),
      stretch_(medium.transform().voxelSize() / medium.transform().meanVoxelSize()),
      wavefront_(medium.density.topology, stretch_, directions, kAside),
      cuts_(findSurfaceCuts(wavefront_, medium.transform(), occluder, surfaces)) {}

std::array<BlockMask, 6> FaceProbe::openFaces(size_t b) const {
  std::array<BlockMask, 6> open = medium_.topology().outerFaces(b);
  if (walls_.empty()) return open;
  const auto list = walls_.find(static_cast<int32_t>(b));
  if (list == walls_.end()) return open;
  for (const WallFace& wall : list->second) open[wall.face].setOff(wall.voxel);
  return open;
}

std::unique_ptr<SurfaceLight> FaceProbe::surfaceLight(int channel) const {
  if (cuts_.empty()) return nullptr;
  return std::make_unique<SurfaceLight>(wavefront_, cuts_, surfaces_, channel);
}

FaceLight FaceProbe::glow(const ChannelOptics& optics, int channel) const {
  const std::unique_ptr<SurfaceLight> surfaces = surfaceLight(channel);
  if (!surfaces) return pass(optics, nullptr);
  const Obstacles in_light = surfaces->obstacles(), obstacles = forDepths(in_light);
  FaceLight light = pass(optics, &obstacles);
  if (surfaces->reflects()) {
    surfaces->turn();
    light = pass(optics, &obstacles);
  }
  return light;
}

/// Takes all rays through all blocks. visit(block, octant, goOn) for each block on an octant's way calls
/// goOn(step), which calls step(lattice, view, turned, part, rays) for each direction.
template <typename Visit>
void FaceProbe::walk(const ChannelOptics& optics, const Obstacles* obstacles, const Visit& visit) const {
  for (int octant = 0; octant < Wavefront::kOctants; ++octant) {
    const std::vector<RayLattice>& lattices = wavefront_.lattices(octant);
    double taken = 0;
    passObstructed(wavefront_, octant, obstacles, taken, [&](size_t b, const auto& passDirection) {
      alignas(64) float tau[kBlockVoxels], turned_tau[kBlockVoxels];
      depthsOf(optics, medium_, b, tau);
      turnBlock(tau, turned_tau);
      uint64_t open[6][3][kBlockWidth];
      layersOf(openFaces(b), open);
      visit(b, octant, [&](const auto& step) {
        for (size_t d = 0; d < lattices.size(); ++d) {
          const bool turned = lattices[d].w == 2;
          BlockView block{turned ? turned_tau : tau, {}, 0, 0};
          block.layFor(lattices[d].w, open);
          passDirection(d, [&](Stretch part, float* rays) { step(lattices[d], block, turned, part, rays); });
        }
      });
    });
  }
}

FaceLight FaceProbe::pass(const ChannelOptics& optics, const Obstacles* obstacles) const {
  const Topology& topology = medium_.topology();
  FaceLight light{Field<float>(topology), Field<float>(topology)};
  walk(optics, obstacles, [&](size_t b, int, const auto& goOn) {
    alignas(64) float entering[kBlockVoxels] = {}, leaving[kBlockVoxels] = {};
    goOn([&](const RayLattice& lattice, const BlockView& block, bool turned, Stretch part, float* rays) {
      passDepths(lattice, block, topology.origin(b), part, rays, turned ? entering : light.entering.block(b),
                 turned ? leaving : light.leaving.block(b));
    });
    addTurnedBack(entering, light.entering.block(b));
    addTurnedBack(leaving, light.leaving.block(b));
  });
  return light;
}

Field<float> FaceProbe::entering(const ChannelOptics& optics, const Field<float>& S,
                                 const std::vector<std::vector<OpenFace>>& faces, const FaceValues& leaving,
                                 SurfaceLight* surfaces) const {
  const Topology& topology = medium_.topology();
  Field<float> light(topology);
  std::optional<Obstacles> obstacles;
  if (surfaces) obstacles = surfaces->obstacles();
  walk(optics, obstacles ? &*obstacles : nullptr, [&](size_t b, int octant, const auto& goOn) {
    alignas(64) float turned_S[kBlockVoxels], out[3][kBlockVoxels], turned_out[3][kBlockVoxels],
        entering[kBlockVoxels] = {};
    turnBlock(S.block(b), turned_S);
    for (int a = 0; a < 3 && !faces[b].empty(); ++a) std::fill_n(out[a], kBlockVoxels, 0.0f);
    const Vec3d& s = wavefront_.lattices(octant).front().s;
    for (size_t k = 0; k < faces[b].size(); ++k) {
      const int axis = faces[b][k].face / 2;
      if (faces[b][k].face % 2 == (s[axis] > 0 ? 1 : 0)) out[axis][faces[b][k].voxel] = leaving[b][k];
    }
    for (int a = 0; a < 3 && !faces[b].empty(); ++a) turnBlock(out[a], turned_out[a]);
    goOn([&](const RayLattice& lattice, const BlockView& block, bool turned, Stretch part, float* rays) {
      const auto* from = turned ? turned_out : out;
      const BlockSources sources{turned ? turned_S : S.block(b), {from[0], from[1], from[2]}};
      passLight(lattice, block, sources, topology.origin(b), part, rays, turned ? entering : light.block(b));
    });
    addTurnedBack(entering, light.block(b));
  });
  return light;
}

void depthsOf(const ChannelOptics& optics, const Medium& medium, size_t b, float* tau) {
  const float* rho = medium.density.values.block(b);
  const double h = medium.transform().meanVoxelSize();
  if (!optics.albedo_field) {
    const float usual = static_cast<float>(optics.sigma_t_beam * h);
    for (int n = 0; n < kBlockVoxels; ++n) tau[n] = usual * rho[n];
    return;
  }
  for (int n = 0; n < kBlockVoxels; ++n)
    tau[n] = static_cast<float>(optics.at(b, n).sigma_t_beam * h * rho[n]);
}

}  // namespace vdb_diffuse
