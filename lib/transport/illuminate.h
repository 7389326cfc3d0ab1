#pragma once

#include "diffusion/diffuse.h"

namespace vdb_diffuse {

struct TransportSettings {
  int sweeps = 2;  ///< after the diffusion solve, each followed by a correction
  std::optional<double>
      error;                  ///< sweep until the estimated error is at most this; `sweeps` is then the most
  int directions = 96;        ///< of a sweep, see halfRangeSet
  int fine_directions = 168;  ///< of later sweeps, and of all where surfaces reflect
  int coarse_sweeps = 2;      ///< with the fewer: what is left after them is theirs
};

/// Diffusion, then transport sweeps that buy its model error down.
///
/// A sweep integrates the transport equation with the light of the step before as scattering source
/// (sweep.h). What the swept light leaves unbalanced,
///
///     R = sigma_s rho Q0 + sigma_a rho Q - sigma_a rho I0 - div F,
///
/// is the source of a diffusion solve with the same operator, whose solution d and flux -D grad d are added:
/// diffusion synthetic acceleration (Alcouffe 1977; Larsen 1984). Energy closes after every step.
DiffuseResult illuminate(const Medium& medium, const Scene& scene, const DiffuseSettings& settings,
                         const TransportSettings& transport);

}  // namespace vdb_diffuse
