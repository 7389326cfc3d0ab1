#pragma once

#include "scene/scene.h"

namespace vdb_diffuse {

/// Lights that are solved for together and apart from others.
struct LightGroup {
  std::string name;
  std::vector<NamedLight> lights;
  bool emission = true;  ///< does the medium's self-emission belong to it?
};

/// Lights by their `group`, or by their name where they have none; a light without either is a group of its
/// own, named by its kind: sun, point, spot, area, dome; the second of a kind sun_2 and so on. Names can
/// stand in that of a grid: what is no letter, digit, '.' or '-' becomes '_'. In the order of the lights;
/// the medium's own light comes last, as "emission".
std::vector<LightGroup> groupLights(const Scene& scene, bool emission);

}  // namespace vdb_diffuse
