#include "diffusion/mean_depth.h"

#include <algorithm>

namespace vdb_diffuse {

MeanDepth meanDepth(const Medium& medium, const ChannelOptics& optics) {
  const Topology& topology = medium.topology();
  struct Sums {
    double voxels = 0, density = 0, plain = 0, square = 0, scattering = 0, transport = 0;
    void operator+=(const Sums& o) {
      voxels += o.voxels;
      density += o.density;
      plain += o.plain;
      square += o.square;
      scattering += o.scattering;
      transport += o.transport;
    }
  };
  const Sums sums = sumOverBlocks<Sums>(topology.blockCount(), [&](size_t b) {
    Sums sum;
    const float* rho = medium.density.values.block(b);
    for (int n = 0; n < kBlockVoxels; ++n) {
      const ChannelOptics there = optics.at(b, n);
      const double met = there.sigma_t_beam * rho[n];
      sum.voxels += rho[n] > 0;
      sum.density += rho[n];
      sum.plain += met;
      sum.square += met * rho[n];
      sum.scattering += there.sigma_s * rho[n] * rho[n];
      sum.transport += there.sigma_tr * rho[n] * rho[n];
    }
    return sum;
  });
  if (!(sums.density > 0 && optics.sigma_t_beam > 0)) return {};
  const double h = medium.transform().meanVoxelSize();
  return {h * sums.plain / sums.voxels, h * sums.square / sums.density, h * sums.transport / sums.density,
          sums.scattering / sums.square};
}

double mostDepth(const Medium& medium, const ChannelOptics& optics) {
  struct Most {
    double depth = 0;
    void operator+=(const Most& o) { depth = std::max(depth, o.depth); }
  };
  const Most most = sumOverBlocks<Most>(medium.topology().blockCount(), [&](size_t b) {
    Most m;
    const float* rho = medium.density.values.block(b);
    if (optics.albedo_field)
      for (int n = 0; n < kBlockVoxels; ++n) m += {rho[n] * optics.at(b, n).sigma_t_beam};
    else
      m += {*std::max_element(rho, rho + kBlockVoxels) * optics.sigma_t_beam};
    return m;
  });
  return most.depth * medium.transform().meanVoxelSize();
}

}  // namespace vdb_diffuse
