#include "scene/colour.h"

#include <algorithm>

namespace vdb_diffuse {
namespace {

template <typename Colour>
bool grey(const Colour& c) {
  return c[0] == c[1] && c[0] == c[2];
}

}  // namespace

Vec3d& strengthOf(Light& light) {
  if (auto* sun = std::get_if<SunLight>(&light)) return sun->irradiance;
  if (auto* point = std::get_if<PointLight>(&light)) return point->intensity;
  if (auto* spot = std::get_if<SpotLight>(&light)) return spot->intensity;
  if (auto* area = std::get_if<AreaLight>(&light)) return area->radiance;
  return std::get<DomeLight>(light).radiance;
}

const Vec3d& strengthOf(const Light& light) {
  return strengthOf(const_cast<Light&>(light));
}

bool hasColouredImage(const Light& light) {
  const auto* dome = std::get_if<DomeLight>(&light);
  return dome && dome->image &&
         !std::all_of(dome->image->pixels.begin(), dome->image->pixels.end(), grey<Vec3f>);
}

bool greyLights(const std::vector<NamedLight>& lights) {
  return std::all_of(lights.begin(), lights.end(), [](const NamedLight& named) {
    return grey(strengthOf(named.light)) && !hasColouredImage(named.light);
  });
}

bool greySurfaces(const std::vector<Surface>& surfaces) {
  return std::all_of(surfaces.begin(), surfaces.end(), [](const Surface& s) { return grey(s.albedo); });
}

bool greyScene(const Scene& scene) {
  return greyLights(scene.lights) && greySurfaces(scene.surfaces);
}

}  // namespace vdb_diffuse
