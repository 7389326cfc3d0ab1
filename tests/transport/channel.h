#pragma once

#include <memory>
#include <optional>

#include "diffusion/diffuse.h"
#include "medium/angular_basis.h"
#include "volumes.h"

namespace vdb_diffuse {

/// All that a ChannelSolution refers to, for a medium with given light instead of a scene's.
struct Channel {
  Medium medium;
  std::unique_ptr<Equation> equation;
  std::unique_ptr<Multigrid> multigrid;
  Field<float> Q0;
  VectorField Q1_flux;
  std::vector<Field<float>> Q2_moments;
  std::optional<BeamShape> shape;
  RightHandSide rhs;
  Occluder nothing{std::vector<Surface>{}};

  Channel(Medium given, double cap = std::numeric_limits<double>::infinity())
      : medium(std::move(given)), Q0(medium.topology()) {
    for (Field<float>& component : Q1_flux) component = Field<float>(medium.topology());
    for (int k = kFirstOrder; k < kSecondOrder; ++k) Q2_moments.emplace_back(medium.topology());
    EquationSettings settings;
    settings.staircase = false;
    settings.cap = cap;
    equation = std::make_unique<Equation>(formEquation(
        medium, channelOptics(medium.optics, 0, Model::kDefault, 2), 0, Model::kDefault, settings));
    multigrid = std::make_unique<Multigrid>(equation->A);
  }

  /// With the diffuse light I0(p) and no flux.
  template <typename Function>
  ChannelSolution solution(double scale, const Function& I0) {
    const Field<float>* glow = medium.emission.empty() ? nullptr : &medium.emissionIn(0);
    ChannelSolution channel(*equation, multigrid.get(),
                            {&Q0, &Q1_flux, shape ? &*shape : nullptr, glow, scale}, &Q2_moments, rhs,
                            nothing);
    for (Field<float>& component : channel.flux) component = Field<float>(medium.topology());
    forEachVoxel(medium.topology(), [&](Coord p, size_t i) { channel.I0[i] = scale * I0(p); });
    return channel;
  }
};

}  // namespace vdb_diffuse
