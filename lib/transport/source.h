#pragma once

#include "diffusion/diffuse.h"
#include "medium/sweep.h"

namespace vdb_diffuse {

/// The source function of the light that scatters next, one channel as it stands,
///
///     J = albedo (Q0 + I0) + (1 - albedo) Q + 3 g' albedo (Q1_flux + I1/3).s + p2' albedo (second
///     moments).b(s)
///
/// in the medium that the equation sees (rescaled where g > 0, so that these moments of the phase function
/// are all). Linear in the voxel, without which thick voxels would lose light too fast.
///
/// \param slope  of the diffuse light, per voxel
/// \param second  second moments of the diffuse light, from the last sweep; empty: not known yet, taken as 0
void formSweepSource(const ChannelSolution& channel, const Medium& medium, const VectorField& slope,
                     const std::vector<Field<float>>& second, SweepSource& source);

}  // namespace vdb_diffuse
