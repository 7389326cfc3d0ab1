#include "transport/source.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "diffusion/source_shape.h"
#include "medium/angular_basis.h"
#include "multigrid/block_kernel.h"

namespace vdb_diffuse {

void formSweepSource(const ChannelSolution& channel, const Medium& medium, const VectorField& beam_slope,
                     const std::vector<Field<float>>& second, SweepSource& source) {
  const Equation& e = channel.equation;
  const Topology& topology = *e.A->topology;
  const double extinction = e.optics.sigma_t_beam,
               albedo = extinction > 0 ? e.optics.sigma_s / extinction : 0;
  const double emission =
      medium.emission.empty() ? 0 : (1 - albedo) * medium.optics.emission_scale * channel.scale;
  const double anisotropy = std::sqrt(3.0) * e.optics.g * albedo;  // of the moments, sqrt(3) times the flux
  source.tau = Field<float>(topology);
  source.J = Field<float>(topology);
  for (Field<float>& slope : source.slope) slope = Field<float>(topology);
  source.angular.clear();
  const double second_order = e.optics.p2 * albedo;
  const int moments = second_order != 0 ? kSecondOrder : anisotropy != 0 ? kFirstOrder : 0;
  for (int k = 0; k < moments; ++k) source.angular.emplace_back(topology);

  diffusiveFlux(e, medium, channel.I0, {}, nullptr, &source.slope);
  forEachBlock(topology.blockCount(), [&](size_t b) {
    const float *rho = medium.density.values.block(b), *Q0 = channel.Q0.block(b);
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      source.tau.block(b)[n] = static_cast<float>(extinction * e.h * rho[n]);
      const double Q = emission != 0 ? emission * medium.emission.block(b)[n] : 0;
      source.J.block(b)[n] =
          static_cast<float>(albedo * (channel.I0.block(b)[n] + channel.scale * Q0[n]) + Q);
      for (int k = 0; k < std::min(moments, kFirstOrder); ++k) {
        const double of_beams = channel.Q1_flux ? channel.scale * (*channel.Q1_flux)[k].block(b)[n] : 0;
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
  forEachBlock(topology.blockCount(), [&](size_t b) {
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      for (int a = 0; a < 3; ++a) {
        float& slope = source.slope[a].block(b)[n];
        slope = static_cast<float>(albedo * (static_cast<double>(slope) + beam_slope[a].block(b)[n]));
      }
    }
  });
}

void formBeamSlope(const ChannelSolution& channel, const Medium& medium, VectorField& slope) {
  const Equation& e = channel.equation;
  const Topology& topology = *e.A->topology;
  const double tau_s = e.optics.sigma_s * e.h, extinction = e.optics.sigma_t_beam * e.h;
  for (Field<float>& component : slope) component = Field<float>(topology);
  diffusiveFlux(e, medium, Field<double>(topology), {&channel.Q0, channel.Q1_flux, channel.scale}, nullptr,
                &slope);
  if (!channel.Q1_flux) return;
  for (int a = 0; a < 3; ++a)
    forEachBlock(topology.blockCount(), [&](size_t b) {
      const float *rho = medium.density.values.block(b), *r = e.A->half_resistance.block(b);
      const float* flux = (*channel.Q1_flux)[a].block(b);
      for (auto it = topology.active(b).beginOn(); it; ++it) {
        const int n = static_cast<int>(it.pos());
        const double s = e.stretch[a], tau = extinction * rho[n] * s;
        const double bend = 2 * r[n] * tau_s * rho[n] * s * s * beamBend(tau);
        slope[a].block(b)[n] += static_cast<float>(channel.scale * flux[n] * (beamSlope(tau) + bend));
      }
    });
}

}  // namespace vdb_diffuse
