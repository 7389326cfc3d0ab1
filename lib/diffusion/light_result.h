#pragma once

#include "diffusion/diffuse.h"

namespace vdb_diffuse {

/// What one group of lights brings to the volume: their first scatter to begin with, and channel by channel
/// the light that has scattered.
class LightResult {
 public:
  LightResult(const Medium& medium, const DiffuseSettings& settings, bool emission, FirstScatter source);

  FirstScatter source;
  double seconds_source = 0, seconds_solve = 0, seconds_sweeps = 0;

  size_t channels() const { return source.direct.size(); }
  /// Does the medium's self-emission belong to the group?
  bool emission() const { return emission_; }
  /// Frees what of a channel's first scatter only its right-hand side asks for.
  void forgetShape(size_t c);

  void add(size_t c, const ChannelOptics& optics, const ChannelSolution& channel);
  /// A channel in which nothing scatters and nothing glows.
  void addDark() { result_.diffuse.emplace_back(topology()); }
  DiffuseResult finish();

 private:
  const Medium& medium_;
  const DiffuseSettings& settings_;
  bool emission_;
  DiffuseResult result_;

  const Topology& topology() const { return medium_.topology(); }
  double weight(size_t c) const { return channels() == 1 ? 1 : kLuminance[c]; }
  double absorbedOf(const Equation& e, const Field<double>& x) const;
  void addEnergy(size_t c, const ChannelOptics& optics, const ChannelSolution& channel);
  void addFlux(size_t c, const ChannelSolution& channel);
  void store(size_t c, const ChannelSolution& channel);
};

/// Sum of term(block, voxel) over the active voxels.
template <typename Term>
double sumOverVoxels(const Topology& topology, const Term& term) {
  return sumOverBlocks<double>(topology.blockCount(), [&](size_t b) {
    double sum = 0;
    for (auto it = topology.active(b).beginOn(); it; ++it) sum += term(b, static_cast<int>(it.pos()));
    return sum;
  });
}

}  // namespace vdb_diffuse
