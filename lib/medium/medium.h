#pragma once

#include <memory>

#include "grid/volume.h"

namespace vdb_diffuse {

/// How the stuff of a density grid scatters and absorbs. RGB; grey where the three agree.
struct Optics {
  Vec3d sigma_s{1, 1, 1};     ///< scattering per unit density, 1/(length density), >= 0
  Vec3d sigma_a{0, 0, 0};     ///< absorption per unit density, 1/(length density), >= 0
  double g = 0;               ///< mean scattering cosine, -1 < g < 1
  double emission_scale = 1;  ///< factor on the emission grid's radiance Q

  Vec3d sigmaT() const { return sigma_s + sigma_a; }
  bool grey() const {
    return sigma_s[0] == sigma_s[1] && sigma_s[0] == sigma_s[2] && sigma_a[0] == sigma_a[1] &&
           sigma_a[0] == sigma_a[2];
  }
};

/// A density grid with its optics; all lengths are world units.
///
/// The stuff may scatter more in one place than in another, and absorb as much less: with the factor a of an
/// albedo field,
///
///     sigma_s(x) = a(x) sigma_s,     sigma_a(x) = sigma_a + (1 - a(x)) sigma_s,     sigma_t(x) = sigma_t
struct Medium {
  Volume density;
  Channels emission;  ///< radiance Q (before `emission_scale`) on the density's topology; empty: none
  Channels albedo;    ///< a, 0..1, on the density's topology, one for all channels or three; empty: 1
  Optics optics;

  const Topology& topology() const { return *density.topology; }
  const Transform& transform() const { return density.transform; }
  /// Only for a medium that has an emission.
  const Field<float>& emissionIn(int channel) const { return emission[emission.size() == 1 ? 0 : channel]; }
  /// Null: 1 everywhere.
  const Field<float>* albedoIn(int channel) const {
    return albedo.empty() ? nullptr : &albedo[albedo.size() == 1 ? 0 : channel];
  }
  /// sigma_a of a voxel, which counts as fields do.
  double absorptionIn(int channel, size_t voxel) const {
    const Field<float>* a = albedoIn(channel);
    return optics.sigma_a[channel] + (a ? (1 - double{(*a)[voxel]}) * optics.sigma_s[channel] : 0);
  }
  /// One solve serves all channels: the operator does not depend on the colour.
  bool greyOptics() const { return optics.grey() && albedo.size() <= 1; }
  /// One channel serves all, as far as the medium goes.
  bool grey() const { return greyOptics() && emission.size() <= 1; }
};

}  // namespace vdb_diffuse
