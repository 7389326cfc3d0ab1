#pragma once

#include "reference/lamp.h"

namespace vdb_diffuse {

/// Lamps at infinity: suns and domes. Nothing where the light has no power.
std::unique_ptr<Lamp> sunLamp(const SunLight& sun, const Scenery& scenery);
std::unique_ptr<Lamp> domeLamp(const DomeLight& dome, const Scenery& scenery);

}  // namespace vdb_diffuse
