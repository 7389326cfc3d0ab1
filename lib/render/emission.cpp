#include "render/emission.h"

#include <algorithm>

namespace vdb_diffuse {
namespace {

/// A grey field serves every channel.
double valueOf(const Channels& channels, int channel, size_t voxel) {
  if (channels.empty()) return 0;
  return channels[channels.size() == 1 ? 0 : channel][voxel];
}

double luminanceOf(const Channels& channels, size_t voxel) {
  return luminance(
      Vec3d(valueOf(channels, 0, voxel), valueOf(channels, 1, voxel), valueOf(channels, 2, voxel)));
}

}  // namespace

bool grey(const LitVolume& lit) {
  return lit.medium.grey() && lit.diffuse.size() <= 1 && lit.direct.size() <= 1;
}

template <int kChannels>
Field<VoxelLight<kChannels>> emittedToward(const Camera& camera, const LitVolume& lit) {
  constexpr double kFluxToI1 = 3 / (4 * 3.14159265358979323846);
  const Medium& medium = lit.medium;
  const Topology& topology = medium.topology();
  const Optics& optics = medium.optics;
  const bool forward = optics.g != 0 && !lit.flux[0].empty();
  Field<VoxelLight<kChannels>> light(topology, VoxelLight<kChannels>{});
  forEachBlock(topology.blockCount(), [&](size_t b) {
    for (auto active = topology.active(b).beginOn(); active; ++active) {
      const int n = static_cast<int>(active.pos());
      const size_t i = b * kBlockVoxels + n;
      const double rho = medium.density.values[i];
      if (!(rho > 0)) continue;
      double along = 0;  // g I1.s
      if (forward) {
        const Coord p_index = topology.origin(b) + voxelLocal(n);
        const Vec3d s = camera.toward(medium.transform().toWorld(p_index.asVec3d()));
        along = optics.g * kFluxToI1 * Vec3d(lit.flux[0][i], lit.flux[1][i], lit.flux[2][i]).dot(s);
      }
      const double mean = lit.diffuse.size() == 3 ? luminanceOf(lit.diffuse, i) : 0;
      VoxelLight<kChannels>& voxel = light[i];
      voxel.rho = static_cast<float>(rho);
      for (int c = 0; c < kChannels; ++c) {
        const double diffuse = valueOf(lit.diffuse, c, i);
        const double tint = mean > 0 ? diffuse / mean : 1;
        const double scattered = valueOf(lit.direct, c, i) + diffuse + along * tint;
        const double Q = valueOf(medium.emission, c, i) * optics.emission_scale;
        const double sigma_s = optics.sigma_s[c] * (medium.albedo.empty() ? 1 : valueOf(medium.albedo, c, i));
        const double sigma_a = medium.absorptionIn(c, i);
        voxel.emitted[c] = static_cast<float>(rho * (sigma_s * std::max(0.0, scattered) + sigma_a * Q));
      }
    }
  });
  return light;
}

template Field<VoxelLight<1>> emittedToward<1>(const Camera&, const LitVolume&);
template Field<VoxelLight<3>> emittedToward<3>(const Camera&, const LitVolume&);

}  // namespace vdb_diffuse
