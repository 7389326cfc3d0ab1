#pragma once

#include "scene/scene.h"

namespace vdb_diffuse {

/// The factor on a light's strength: its irradiance, intensity or radiance.
Vec3d& strengthOf(Light& light);
const Vec3d& strengthOf(const Light& light);

/// Does a picture give the light its colours?
bool hasColouredImage(const Light& light);

bool greyLights(const std::vector<NamedLight>& lights);
/// Does every surface reflect all colours alike?
bool greySurfaces(const std::vector<Surface>& surfaces);
/// Both: one channel serves all, as far as the scene goes.
bool greyScene(const Scene& scene);

}  // namespace vdb_diffuse
