#pragma once

#include "scene/light_samples.h"

namespace vdb_diffuse {

/// At most `count` beams that together carry all of a dome light: their irradiances add up to the integral of
/// its radiance over the sphere, channel by channel.
///
/// A uniform dome is a spherical Fibonacci lattice. An image is cut into cells after Debevec, "A median cut
/// algorithm for light probe sampling" (2005): the cell with the largest energy times squared extent is
/// halved by energy across its longer side, between two pixels where there are two. A beam carries the cell's
/// integral and comes from the cell's mean direction, weighted by luminance.
std::vector<BeamSample> sampleDome(const DomeLight& dome, int count);

}  // namespace vdb_diffuse
