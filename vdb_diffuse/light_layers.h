#pragma once

#include <string>

#include "render/render.h"

namespace vdb_diffuse {

/// A picture and its two parts, which add up to it: what the volume shows of light that
/// comes straight from the lights, and of light that has scattered in it before, with its own glow.
struct LightLayers {
  Picture both;
  Image direct, diffuse;
};

/// \param lit   is left as it was
LightLayers renderLayers(LitVolume& lit, const Camera& camera, const RenderSettings& settings,
                         const Progress& progress);

/// The three side by side as a PNG file's bytes, with their names, under one exposure.
/// \param background   radiance behind the volume, in the picture of both only
std::string contactSheet(const LightLayers& layers, double exposure, const Vec3d& background);

}  // namespace vdb_diffuse
