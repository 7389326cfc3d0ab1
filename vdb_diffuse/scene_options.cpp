#include "scene_options.h"

#include <algorithm>
#include <cmath>

#include "grid/error.h"
#include "io/image.h"
#include "io/json_file.h"
#include "io/mesh_file.h"
#include "scene/repeated_triangles.h"
#include "words.h"

namespace vdb_diffuse {
namespace {

/// Calls change(light) for every light of one kind; how many there were.
template <typename Kind, typename Change>
int forEachLight(Scene& scene, const Change& change) {
  int count = 0;
  for (NamedLight& named : scene.lights)
    if (auto* light = std::get_if<Kind>(&named.light)) {
      change(*light);
      ++count;
    }
  return count;
}

template <typename Kind>
void replaceLights(Scene& scene, const std::string& name, const Kind& light) {
  auto& lights = scene.lights;
  lights.erase(std::remove_if(lights.begin(), lights.end(),
                              [](const NamedLight& l) { return std::holds_alternative<Kind>(l.light); }),
               lights.end());
  lights.push_back({name, light});
}

DomeLight domeOf(const std::string& env) {
  if (numbersIn(env)) return DomeLight{rgbIn("--env", env, kStrongestLight), nullptr, 0};
  if (extensionOf(env) != ".exr")
    refuseWord("--env", env, "expected a radiance (a number or r,g,b) or the path of an .exr image");
  return DomeLight{Vec3d(1), std::make_shared<const Image>(readExr(env)), 0};
}

void layLights(const SceneOptions& o, Scene& scene) {
  if (o.sun) replaceLights(scene, "--sun", SunLight{directionIn("--sun", *o.sun), Vec3d(1), 0});
  if (o.sun_irradiance) {
    const Vec3d irradiance = rgbIn("--sun-irradiance", *o.sun_irradiance, kStrongestLight);
    if (!forEachLight<SunLight>(scene, [&](SunLight& sun) { sun.irradiance = irradiance; }))
      refuseWord("--sun-irradiance", *o.sun_irradiance,
                 "there is no sun; give its direction with --sun X,Y,Z");
  }
  if (o.env) replaceLights(scene, "--env", domeOf(*o.env));
  if (o.env_scale) {
    const double scale = numberIn("--env-scale", *o.env_scale, 0, kStrongestLight);
    if (!forEachLight<DomeLight>(scene, [&](DomeLight& dome) { dome.radiance *= scale; }))
      refuseWord("--env-scale", *o.env_scale, "there is no environment; give one with --env");
  }
}

void laySurfaces(const SceneOptions& o, Up up, Scene& scene) {
  if (!o.occluders.empty()) scene.surfaces.clear();
  size_t triangles = 0;
  for (const std::string& path : o.occluders) {
    scene.surfaces.push_back({path, readMesh(path, up), Vec3d(0)});
    if ((triangles += scene.surfaces.back().mesh.triangles.size()) > kMostTriangles)
      throw InputError(path + ": the occluders together have more than " + std::to_string(kMostTriangles) +
                       " triangles");
  }
  if (!o.occluder_albedo) return;
  const Vec3d albedo = rgbIn("--occluder-albedo", *o.occluder_albedo, 1);
  if (scene.surfaces.empty())
    refuseWord("--occluder-albedo", *o.occluder_albedo, "there is no surface; give one with --occluder");
  for (Surface& surface : scene.surfaces) surface.albedo = albedo;
}

/// One grid or the other glows: a flag replaces what the scene file says.
void layGlow(const SceneOptions& o, MediumSettings& medium) {
  if (o.emission && o.temperature)
    throw UsageError("give either --emission or --temperature: one grid says how the medium glows");
  if (o.emission) {
    medium.emission = o.emission;
    medium.temperature.reset();
  }
  if (o.temperature) {
    medium.temperature = o.temperature;
    medium.emission.reset();
  }
  const auto number = [](const char* flag, const std::optional<std::string>& text,
                         std::optional<double>& value) {
    if (text) value = numberIn(flag, *text, 0);
  };
  number("--emission-scale", o.emission_scale, medium.emission_scale);
  number("--temperature-scale", o.temperature_scale, medium.temperature_scale);
  number("--blackbody-intensity", o.blackbody_intensity, medium.blackbody_intensity);
}

void layMedium(const SceneOptions& o, MediumSettings& medium) {
  if (o.density) medium.density = o.density;
  if (o.albedo_grid) medium.albedo_grid = o.albedo_grid;
  layGlow(o, medium);
  if (o.min_density) medium.min_density = numberIn("--min-density", *o.min_density, 0);
  if (o.crop) medium.crop = boxIn("--crop", *o.crop);
  if (o.sigma_s) medium.sigma_s = rgbIn("--sigma-s", *o.sigma_s);
  if (o.sigma_a) medium.sigma_a = rgbIn("--sigma-a", *o.sigma_a);
  if (o.sigma_t || o.albedo) {
    if (o.sigma_s || o.sigma_a)
      throw UsageError("give either --sigma-s and --sigma-a, or --sigma-t and --albedo, not parts of both");
    if (!o.albedo) refuseWord("--sigma-t", *o.sigma_t, "needs --albedo, which says how much of it scatters");
    if (!o.sigma_t) refuseWord("--albedo", *o.albedo, "needs --sigma-t");
    const Vec3d sigma_t = rgbIn("--sigma-t", *o.sigma_t), albedo = rgbIn("--albedo", *o.albedo, 1);
    medium.sigma_s = albedo * sigma_t;
    medium.sigma_a = (Vec3d(1) - albedo) * sigma_t;
  }
  if (o.g) {
    medium.g = numberIn("--g", *o.g, -1, 1);
    if (std::abs(*medium.g) == 1) refuseWord("--g", *o.g, "must lie between -1 and 1, both excluded");
  }
}

}  // namespace

void SceneOptions::addMediumTo(CLI::App& app, MediumDefaults defaults) {
  const bool baked = defaults == MediumDefaults::kAsBaked;
  const std::string group =
      std::string("Medium (V is a number or r,g,b") + (baked ? "; default: as baked)" : ")");
  const auto add = [&](const std::string& flag, std::optional<std::string>& value, const std::string& type,
                       const std::string& help, const std::string& usual = "") {
    addWord(app, group, flag, value, type,
            help + (baked || usual.empty() ? "" : " (default: " + usual + ")"));
  };
  add("--density", density, "NAME", "Density grid", "'density', else the only float fog grid");
  add("--sigma-s", sigma_s, "V", "Scattering per unit density", "1");
  add("--sigma-a", sigma_a, "V", "Absorption per unit density", "0");
  add("--sigma-t", sigma_t, "V", "Extinction per unit density, with --albedo instead of the two above");
  add("--albedo", albedo, "V", "Share of --sigma-t that scatters, 0 to 1");
  add("--albedo-grid", albedo_grid, "NAME",
      "Grid of colours or numbers in 0..1, as Cd: scattering is times it, and absorption larger by what that "
      "takes, so that extinction stays; in voxels that it does not have, its background");
  add("--g", g, "NUMBER", "Mean scattering cosine, between -1 and 1", "0");
  add("--emission", emission, "NAME", "Self-emission grid: radiance Q, emits sigma_a rho Q");
  add("--emission-scale", emission_scale, "NUMBER", "Factor on it", "1");
  add("--temperature", temperature, "NAME",
      "Temperature grid: glows as a black body, Q by Planck's law; instead of --emission");
  add("--temperature-scale", temperature_scale, "NUMBER", "Kelvin per unit of the temperature grid", "1");
  add("--blackbody-intensity", blackbody_intensity, "NUMBER", "Factor on the black body's radiance", "1");
  add("--min-density", min_density, "NUMBER", "Leave voxels of less density out of the medium", "0");
  add("--crop", crop, "x0,y0,z0,x1,y1,z1", "Leave voxels out whose centre is not in this box, world units");
}

void SceneOptions::addTo(CLI::App& app) {
  addMediumTo(app);
  const auto add = [&](const std::string& flag, auto& value, const std::string& type,
                       const std::string& help) {
    return addWord(app, "Light and surfaces (flags override the scene file)", flag, value, type, help);
  };
  add("--scene", scene, "FILE", "Medium, lights and surfaces at once: FILE.json, FILE.glb or FILE.gltf");
  add("--sun", sun, "X,Y,Z", "Direction the sunlight travels; replaces the scene file's suns");
  add("--sun-irradiance", sun_irradiance, "V", "On a plane that faces the sun (default 1); of every sun");
  add("--env", env, "V|FILE.exr",
      "Radiance from all around, or an equirectangular image; replaces the scene file's domes");
  add("--env-scale", env_scale, "NUMBER", "Factor on the radiance of every dome");
  add("--occluder", occluders, "MESH",
      "OBJ or glTF mesh that hides light, may be repeated; replaces the scene file's surfaces")
      ->allow_extra_args(false);
  add("--occluder-albedo", occluder_albedo, "V", "Of every surface, 0 to 1 (default: black)");
  add("--up", up, "y|z", "The volume's axis that points up: glTF files are turned to it (default z)");
}

std::vector<std::string*> SceneOptions::paths() {
  std::vector<std::string*> names;
  if (scene) names.push_back(&*scene);
  if (env && !numbersIn(*env)) names.push_back(&*env);
  for (std::string& occluder : occluders) names.push_back(&occluder);
  return names;
}

SceneFile SceneOptions::resolve() const {
  if (up != "y" && up != "z") refuseWord("--up", up, "must be y or z");
  const Up axis = up == "y" ? Up::kY : Up::kZ;
  SceneFile file;
  layMedium(*this, file.medium);  // first, so that a wrong flag is told before any file is read
  if (scene) file = readSceneFile(*scene, axis);
  layMedium(*this, file.medium);
  layLights(*this, file.scene);
  laySurfaces(*this, axis, file.scene);
  dropRepeatedTriangles(file.scene);
  if (env && !numbersIn(*env)) file.files.push_back(*env);
  file.files.insert(file.files.end(), occluders.begin(), occluders.end());
  return file;
}

}  // namespace vdb_diffuse
