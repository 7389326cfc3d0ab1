#include "transport/source.h"

#include <algorithm>
#include <cmath>

#include "medium/angular_basis.h"

namespace vdb_diffuse {

void formSweepSource(const ChannelSolution& channel, const Medium& medium, const VectorField& slope,
                     const std::vector<Field<float>>& second, SweepSource& source) {
  const Equation& e = channel.equation;
  const Topology& topology = *e.A->topology;
  source.tau = Field<float>(topology);
  source.J = Field<float>(topology);
  for (Field<float>& component : source.slope) component = Field<float>(topology);
  source.angular.clear();
  const double usual = e.optics.albedo();
  const auto albedoAt = [&](size_t b, int n) {
    return e.optics.albedo_field ? e.optics.at(b, n).albedo() : usual;
  };
  const int moments = !(usual > 0) ? 0 : e.optics.p2 != 0 ? kSecondOrder : e.optics.g != 0 ? kFirstOrder : 0;
  for (int k = 0; k < moments; ++k) source.angular.emplace_back(topology);

  const BeamSource& beams = channel.beams;
  const double glow_scale = beams.glow ? medium.optics.emission_scale * channel.scale : 0;
  forEachBlock(topology.blockCount(), [&](size_t b) {
    const float *rho = medium.density.values.block(b), *Q0 = beams.Q0->block(b);
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      const ChannelOptics there = e.optics.at(b, n);
      const double albedo = albedoAt(b, n), emission = (1 - albedo) * glow_scale;
      const double anisotropy = std::sqrt(3.0) * there.g * albedo;  // of the moments, sqrt(3) times the flux
      const double second_order = there.p2 * albedo;
      source.tau.block(b)[n] = static_cast<float>(there.sigma_t_beam * e.h * rho[n]);
      const double Q = emission != 0 ? emission * beams.glow->block(b)[n] : 0;
      source.J.block(b)[n] =
          static_cast<float>(albedo * (channel.I0.block(b)[n] + channel.scale * Q0[n]) + Q);
      for (int k = 0; k < std::min(moments, kFirstOrder); ++k) {
        const double of_beams = beams.Q1_flux ? channel.scale * (*beams.Q1_flux)[k].block(b)[n] : 0;
        source.angular[k].block(b)[n] =
            static_cast<float>(anisotropy * (channel.flux[k].block(b)[n] + of_beams));
      }
      for (int k = kFirstOrder; k < moments; ++k) {
        const double of_beams =
            channel.Q2_moments ? channel.scale * (*channel.Q2_moments)[k - kFirstOrder].block(b)[n] : 0;
        const double diffuse = second.empty() ? 0 : second[k - kFirstOrder].block(b)[n];
        source.angular[k].block(b)[n] = static_cast<float>(second_order * (diffuse + of_beams));
      }
    }
  });
  for (int a = 0; a < 3; ++a)
    forEachBlock(topology.blockCount(), [&](size_t b) {
      const float* lean = beams.shape ? beams.shape->lean[a].block(b) : nullptr;
      for (auto it = topology.active(b).beginOn(); it; ++it) {
        const int n = static_cast<int>(it.pos());
        const double of_beams = lean ? 12 * channel.scale * lean[n] : 0;
        source.slope[a].block(b)[n] = static_cast<float>(albedoAt(b, n) * (slope[a].block(b)[n] + of_beams));
      }
    });
}

}  // namespace vdb_diffuse
