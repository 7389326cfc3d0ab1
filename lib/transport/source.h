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
/// are all). Linear in the voxel, without which thick voxels would lose light too fast: the slope of I0 lies
/// between its values on the two faces as the equation has them, that of Q0 as in source_shape.h.
///
/// \param beam_slope  from formBeamSlope
/// \param second  second moments of the diffuse light, from the last sweep; empty: not known yet, taken as 0
void formSweepSource(const ChannelSolution& channel, const Medium& medium, const VectorField& beam_slope,
                     const std::vector<Field<float>>& second, SweepSource& source);

/// The part of the slope of Q0 + I0 that the beams make, the same for every sweep: Q0's own, and how I0 bends
/// where they scatter.
void formBeamSlope(const ChannelSolution& channel, const Medium& medium, VectorField& slope);

}  // namespace vdb_diffuse
