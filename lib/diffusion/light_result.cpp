#include "diffusion/light_result.h"

#include <algorithm>
#include <cmath>

namespace vdb_diffuse {

LightResult::LightResult(const Medium& medium, const DiffuseSettings& settings, bool emission,
                         FirstScatter first)
    : source(std::move(first)), medium_(medium), settings_(settings), emission_(emission) {
  if (settings.want_flux)
    for (Field<float>& component : result_.flux) component = Field<float>(topology());
}

void LightResult::forgetShape(size_t c) {
  if (!source.shape.empty()) source.shape[c] = {};
  if (!source.beam_flux.empty()) source.beam_flux[c] = {};
}

void LightResult::add(size_t c, const ChannelOptics& optics, const ChannelSolution& channel) {
  result_.converged = result_.converged && channel.converged;
  result_.iterations = std::max(result_.iterations, channel.iterations);
  result_.sweeps = std::max(result_.sweeps, channel.sweeps);
  for (const std::string& warning : channel.warnings) addOnce(warning, result_.warnings);
  if (channel.estimated_error)
    result_.estimated_error = std::max(result_.estimated_error.value_or(0), *channel.estimated_error);
  result_.relative_residual = std::max(result_.relative_residual, channel.relative_residual);
  addEnergy(c, optics, channel);
  store(c, channel);
}

double LightResult::absorbedOf(const Equation& e, const Field<double>& x) const {
  const Field<float>& rho = medium_.density.values;
  return sumOverVoxels(topology(), [&](size_t b, int n) {
    const double tau_a = e.optics.at(b, n).sigma_a * e.h;
    return static_cast<double>(static_cast<float>(tau_a * rho.block(b)[n])) * x.block(b)[n];
  });
}

/// Powers of the light that has scattered. With delta-Eddington the equation's own light is split
/// otherwise: what the rescaling left in the beam has scattered too, and leaves where the beam does.
void LightResult::addEnergy(size_t c, const ChannelOptics& optics, const ChannelSolution& channel) {
  const Equation& e = channel.equation;
  const RightHandSide& rhs = channel.rhs;
  const double unscale = 1 / channel.scale, tau_a = optics.sigma_a * e.h;
  const Field<float>& rho = medium_.density.values;
  const double absorbed = absorbedOf(e, channel.I0);
  const double watts = 4 * M_PI * medium_.transform().voxelVolume() / e.h * weight(c);
  Energy& energy = result_.energy;
  energy.emitted += watts * unscale * rhs.emitted;
  if (source.beam.empty()) {
    energy.scattered_in += watts * unscale * rhs.scattered_in;
    energy.absorbed += watts * unscale * absorbed;
    energy.escaped += watts * unscale * channel.escaped;
    return;
  }
  const auto columnOf = [&](const Field<float>& light) {
    return sumOverVoxels(topology(), [&](size_t b, int n) {
      return static_cast<double>(rho.block(b)[n]) * light.block(b)[n];
    });
  };
  const auto lostOf = [&](const Field<float>& light) {  // the same of what the albedo field takes
    if (!optics.albedo_field) return 0.0;
    return sumOverVoxels(topology(), [&](size_t b, int n) {
      const double lost = 1 - double{optics.albedo_field->block(b)[n]};
      return lost * rho.block(b)[n] * light.block(b)[n];
    });
  };
  const double direct = columnOf(source.direct[c]), lost_direct = lostOf(source.direct[c]);
  const double beam = columnOf(source.beam[c]), lost_beam = lostOf(source.beam[c]);
  const double left_in_beam = e.h * (optics.true_sigma_t * direct - optics.sigma_t_beam * beam -
                                     (optics.true_sigma_s - optics.sigma_s) * lost_beam);
  const double tau_s = optics.true_sigma_s * e.h;
  energy.scattered_in += watts * e.h * optics.true_sigma_s * (direct - lost_direct);
  energy.absorbed +=
      watts * (unscale * absorbed + tau_a * (beam - direct) + tau_s * (lost_beam - lost_direct));
  energy.escaped += watts * (unscale * channel.escaped + left_in_beam);
}

void LightResult::store(size_t c, const ChannelSolution& channel) {
  const double unscale = 1 / channel.scale;
  Field<float> diffuse(topology());
  const bool rescaled = !source.beam.empty();
  struct Negatives {
    size_t count = 0;
    double most = 0;
    void operator+=(const Negatives& o) {
      count += o.count;
      most = std::max(most, o.most);
    }
  };
  const Negatives negatives = sumOverBlocks<Negatives>(topology().blockCount(), [&](size_t b) {
    Negatives negative;
    for (auto it = topology().active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      double value = channel.I0.block(b)[n] * unscale;
      if (rescaled) value += static_cast<double>(source.beam[c].block(b)[n]) - source.direct[c].block(b)[n];
      if (value < 0) negative += {1, -value};
      diffuse.block(b)[n] = static_cast<float>(std::max(0.0, value));
    }
    return negative;
  });
  result_.negative_voxels += negatives.count;
  result_.most_negative = std::max(result_.most_negative, negatives.most);
  if (settings_.want_flux) addFlux(c, channel);
  result_.diffuse.push_back(std::move(diffuse));
}

void LightResult::addFlux(size_t c, const ChannelSolution& channel) {
  VectorField third;  // I1 / 3 along the grid axes, scaled as the solution is
  const bool given = !channel.flux[0].empty();
  if (!given) {
    for (Field<float>& component : third) component = Field<float>(topology());
    diffusiveFlux(channel.equation, medium_, channel.I0, channel.beams, &third);
  }
  const VectorField& along_axes = given ? channel.flux : third;
  forEachBlock(topology().blockCount(), [&](size_t b) {
    for (auto it = topology().active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      Vec3d world(0);
      for (int a = 0; a < 3; ++a) {
        double along = along_axes[a].block(b)[n] / channel.scale;
        if (!source.direct_flux.empty())
          along += source.beam_flux[c][a].block(b)[n] - source.direct_flux[c][a].block(b)[n];
        world += medium_.transform().axis(a) / medium_.transform().axis(a).length() * along;
      }
      for (int a = 0; a < 3; ++a)
        result_.flux[a].block(b)[n] += static_cast<float>(4 * M_PI * weight(c) * world[a]);
    }
  });
}

DiffuseResult LightResult::finish() {
  result_.direct = std::move(source.direct);
  result_.seconds_source = seconds_source;
  result_.seconds_solve = seconds_solve;
  result_.seconds_sweeps = seconds_sweeps;
  if (settings_.refine && !(std::abs(result_.energy.closure()) <= 10 * settings_.tolerance))
    result_.converged = false;
  return std::move(result_);
}

}  // namespace vdb_diffuse
