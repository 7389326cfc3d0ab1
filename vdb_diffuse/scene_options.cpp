#include "scene_options.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <locale>
#include <sstream>

#include "grid/error.h"
#include "io/image.h"

namespace vdb_diffuse {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// "a,b,c" as numbers; nothing where any part is not a finite number.
std::optional<std::vector<double>> numbersIn(const std::string& text) {
  std::vector<double> numbers;
  std::istringstream parts(text + ',');
  for (std::string part; std::getline(parts, part, ',');) {
    std::istringstream in(part);
    in.imbue(std::locale::classic());
    double x;
    if (!(in >> x) || !std::isfinite(x) || !(in >> std::ws).eof()) return std::nullopt;
    numbers.push_back(x);
  }
  return numbers;
}

[[noreturn]] void refuse(const std::string& flag, const std::string& text, const std::string& why) {
  throw UsageError(flag + " " + text + ": " + why);
}

void checkRange(const std::string& flag, const std::string& text, double x, double lowest, double highest) {
  if (x < lowest && lowest == 0 && highest == kInfinity) refuse(flag, text, "must not be negative");
  if (x < lowest || x > highest) {
    std::ostringstream range;
    range << "must be from " << lowest << " to " << highest;
    refuse(flag, text, range.str());
  }
}

double number(const std::string& flag, const std::string& text, double lowest, double highest = kInfinity) {
  const auto numbers = numbersIn(text);
  if (!numbers || numbers->size() != 1) refuse(flag, text, "expected one finite number");
  checkRange(flag, text, numbers->front(), lowest, highest);
  return numbers->front();
}

Vec3d rgb(const std::string& flag, const std::string& text, double highest = kInfinity) {
  const auto numbers = numbersIn(text);
  if (!numbers || (numbers->size() != 1 && numbers->size() != 3))
    refuse(flag, text, "expected a finite number, or three as r,g,b");
  for (double x : *numbers) checkRange(flag, text, x, 0, highest);
  return numbers->size() == 1 ? Vec3d(numbers->front()) : Vec3d(numbers->data());
}

Vec3d direction(const std::string& flag, const std::string& text) {
  const auto numbers = numbersIn(text);
  if (!numbers || numbers->size() != 3) refuse(flag, text, "expected three finite numbers, X,Y,Z");
  const Vec3d v(numbers->data());
  const double scale = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
  if (scale == 0) refuse(flag, text, "a direction cannot be zero");
  return (v / scale).unit();
}

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
  if (numbersIn(env)) return DomeLight{rgb("--env", env), nullptr, 0};
  std::string ending = env.size() > 4 ? env.substr(env.size() - 4) : "";
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (ending != ".exr")
    refuse("--env", env, "expected a radiance (a number or r,g,b) or the path of an .exr image");
  return DomeLight{Vec3d(1), std::make_shared<const Image>(readExr(env)), 0};
}

void layLights(const SceneOptions& o, Scene& scene) {
  if (o.sun) replaceLights(scene, "--sun", SunLight{direction("--sun", *o.sun), Vec3d(1), 0});
  if (o.sun_irradiance) {
    const Vec3d irradiance = rgb("--sun-irradiance", *o.sun_irradiance);
    if (!forEachLight<SunLight>(scene, [&](SunLight& sun) { sun.irradiance = irradiance; }))
      refuse("--sun-irradiance", *o.sun_irradiance, "there is no sun; give its direction with --sun X,Y,Z");
  }
  if (o.env) replaceLights(scene, "--env", domeOf(*o.env));
  if (o.env_scale) {
    const double scale = number("--env-scale", *o.env_scale, 0);
    if (!forEachLight<DomeLight>(scene, [&](DomeLight& dome) { dome.radiance *= scale; }))
      refuse("--env-scale", *o.env_scale, "there is no environment; give one with --env");
  }
}

void laySurfaces(const SceneOptions& o, Up up, Scene& scene) {
  if (!o.occluders.empty()) scene.surfaces.clear();
  for (const std::string& path : o.occluders) scene.surfaces.push_back({path, readMesh(path, up), Vec3d(0)});
  if (!o.occluder_albedo) return;
  const Vec3d albedo = rgb("--occluder-albedo", *o.occluder_albedo, 1);
  if (scene.surfaces.empty())
    refuse("--occluder-albedo", *o.occluder_albedo, "there is no surface; give one with --occluder");
  for (Surface& surface : scene.surfaces) surface.albedo = albedo;
}

void layMedium(const SceneOptions& o, MediumSettings& medium) {
  if (o.density) medium.density = o.density;
  if (o.emission) medium.emission = o.emission;
  if (o.emission_scale) medium.emission_scale = number("--emission-scale", *o.emission_scale, 0);
  if (o.sigma_s) medium.sigma_s = rgb("--sigma-s", *o.sigma_s);
  if (o.sigma_a) medium.sigma_a = rgb("--sigma-a", *o.sigma_a);
  if (o.sigma_t || o.albedo) {
    if (o.sigma_s || o.sigma_a)
      throw UsageError("give either --sigma-s and --sigma-a, or --sigma-t and --albedo, not parts of both");
    if (!o.albedo) refuse("--sigma-t", *o.sigma_t, "needs --albedo, which says how much of it scatters");
    if (!o.sigma_t) refuse("--albedo", *o.albedo, "needs --sigma-t");
    const Vec3d sigma_t = rgb("--sigma-t", *o.sigma_t), albedo = rgb("--albedo", *o.albedo, 1);
    medium.sigma_s = albedo * sigma_t;
    medium.sigma_a = (Vec3d(1) - albedo) * sigma_t;
  }
  if (o.g) {
    medium.g = number("--g", *o.g, -1, 1);
    if (std::abs(*medium.g) == 1) refuse("--g", *o.g, "must lie between -1 and 1, both excluded");
  }
}

}  // namespace

void SceneOptions::addMediumTo(CLI::App& app) {
  const char* group = "Medium (V is a number or r,g,b)";
  app.add_option("--density", density, "Density grid (default: 'density', else the only float fog grid)")
      ->type_name("NAME")
      ->group(group);
  app.add_option("--sigma-s", sigma_s, "Scattering per unit density (default 1)")
      ->type_name("V")
      ->group(group);
  app.add_option("--sigma-a", sigma_a, "Absorption per unit density (default 0)")
      ->type_name("V")
      ->group(group);
  app.add_option("--sigma-t", sigma_t, "Extinction per unit density, with --albedo instead of the two above")
      ->type_name("V")
      ->group(group);
  app.add_option("--albedo", albedo, "Share of --sigma-t that scatters, 0 to 1")
      ->type_name("V")
      ->group(group);
  app.add_option("--g", g, "Mean scattering cosine, between -1 and 1 (default 0)")
      ->type_name("NUMBER")
      ->group(group);
  app.add_option("--emission", emission, "Self-emission grid: radiance Q, emits sigma_a rho Q")
      ->type_name("NAME")
      ->group(group);
  app.add_option("--emission-scale", emission_scale, "Factor on it (default 1)")
      ->type_name("NUMBER")
      ->group(group);
}

void SceneOptions::addTo(CLI::App& app) {
  addMediumTo(app);
  const char* group = "Light and surfaces (flags override the scene file)";
  app.add_option("--scene", scene, "Medium, lights and surfaces at once: FILE.json, FILE.glb or FILE.gltf")
      ->type_name("FILE")
      ->group(group);
  app.add_option("--sun", sun, "Direction the sunlight travels; replaces the scene file's suns")
      ->type_name("X,Y,Z")
      ->group(group);
  app.add_option("--sun-irradiance", sun_irradiance,
                 "On a plane that faces the sun (default 1); of every sun")
      ->type_name("V")
      ->group(group);
  app.add_option("--env", env,
                 "Radiance from all around, or an equirectangular image; replaces the scene file's domes")
      ->type_name("V|FILE.exr")
      ->group(group);
  app.add_option("--env-scale", env_scale, "Factor on the radiance of every dome")
      ->type_name("NUMBER")
      ->group(group);
  app.add_option("--occluder", occluders,
                 "OBJ or glTF mesh that hides light, may be repeated; replaces the scene file's surfaces")
      ->type_name("MESH")
      ->allow_extra_args(false)
      ->group(group);
  app.add_option("--occluder-albedo", occluder_albedo, "Of every surface, 0 to 1 (default: black)")
      ->type_name("V")
      ->group(group);
  app.add_option("--up", up, "The volume's axis that points up: glTF files are turned to it (default z)")
      ->type_name("y|z")
      ->group(group);
}

SceneFile SceneOptions::resolve() const {
  if (up != "y" && up != "z") refuse("--up", up, "must be y or z");
  const Up axis = up == "y" ? Up::kY : Up::kZ;
  SceneFile file;
  layMedium(*this, file.medium);  // first, so that a wrong flag is told before any file is read
  if (scene) file = readSceneFile(*scene, axis);
  layMedium(*this, file.medium);
  layLights(*this, file.scene);
  laySurfaces(*this, axis, file.scene);
  return file;
}

}  // namespace vdb_diffuse
