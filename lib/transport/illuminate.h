#pragma once

#include "transport/refinement.h"

namespace vdb_diffuse {

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

/// The same for each of at least one group of lights. What serves all is done once: operators, hierarchies,
/// the directions' rays; and in a grey medium light is solved for by its colour, not by red, green and blue.
std::vector<DiffuseResult> illuminate(const Medium& medium, const std::vector<Surface>& surfaces,
                                      const std::vector<LightGroup>& groups, const DiffuseSettings& settings,
                                      const TransportSettings& transport);

}  // namespace vdb_diffuse
