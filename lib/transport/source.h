#pragma once

#include "diffusion/diffuse.h"
#include "medium/sweep.h"

namespace vdb_diffuse {

/// The source function of the light that scatters next, one channel as it stands,
///
///     J = albedo (Q0 + I0) + (1 - albedo) Q + 3 g' albedo (Q1_flux + I1/3).s
///
/// in the medium that the equation sees (rescaled where g > 0, so that two moments of the phase function are
/// all). Linear in the voxel, without which thick voxels would lose light too fast: the slope of I0 lies
/// between its values on the two faces as the equation has them, that of Q0 as in source_shape.h.
void formSweepSource(const ChannelSolution& channel, const Medium& medium, SweepSource& source);

}  // namespace vdb_diffuse
