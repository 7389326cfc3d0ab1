#include "io/scene_file.h"

#include <cmath>

#include "grid/error.h"
#include "io/gltf_scene.h"
#include "io/image.h"
#include "io/json_file.h"
#include "io/json_place.h"

namespace vdb_diffuse {
namespace {

constexpr size_t kLargestFile = 16 << 20;  // bytes; meshes and images lie in files of their own
constexpr double kDegree = 3.14159265358979323846 / 180;

using Place = JsonPlace;

WorldBox boxOf(const Place& box) {
  if (!box.value.is_array() || box.value.size() != 6) box.refuseType("six numbers [x0, y0, z0, x1, y1, z1]");
  WorldBox result;
  for (int a = 0; a < 3; ++a) {
    result.low[a] = box[static_cast<size_t>(a)].number();
    result.high[a] = box[static_cast<size_t>(a + 3)].number();
    if (result.low[a] > result.high[a]) box.refuse("the low corner comes first");
  }
  return result;
}

MediumSettings mediumOf(const Place& medium) {
  medium.onlyKeys({"density", "sigma_s", "sigma_a", "sigma_t", "albedo", "g", "albedo_grid", "emission",
                   "emission_scale", "temperature", "temperature_scale", "blackbody_intensity", "min_density",
                   "crop"});
  MediumSettings settings;
  if (medium.has("density")) settings.density = medium["density"].text();
  if (medium.has("albedo_grid")) settings.albedo_grid = medium["albedo_grid"].text();
  if (medium.has("emission")) settings.emission = medium["emission"].text();
  if (medium.has("temperature")) settings.temperature = medium["temperature"].text();
  if (settings.emission && settings.temperature)
    medium.refuse("give either an emission grid or a temperature grid");
  for (const auto& [key, setting] : {std::pair("emission_scale", &settings.emission_scale),
                                     std::pair("temperature_scale", &settings.temperature_scale),
                                     std::pair("blackbody_intensity", &settings.blackbody_intensity),
                                     std::pair("min_density", &settings.min_density)})
    if (medium.has(key)) *setting = medium[key].number(0);
  if (medium.has("crop")) settings.crop = boxOf(medium["crop"]);
  if (medium.has("sigma_s")) settings.sigma_s = medium["sigma_s"].rgb();
  if (medium.has("sigma_a")) settings.sigma_a = medium["sigma_a"].rgb();
  if (medium.has("sigma_t") || medium.has("albedo")) {
    if (settings.sigma_s || settings.sigma_a)
      medium.refuse("give either sigma_s and sigma_a, or sigma_t and albedo");
    medium.needs({"sigma_t", "albedo"});
    const Vec3d sigma_t = medium["sigma_t"].rgb(), albedo = medium["albedo"].rgb(1);
    settings.sigma_s = albedo * sigma_t;
    settings.sigma_a = (Vec3d(1) - albedo) * sigma_t;
  }
  if (medium.has("g")) {
    settings.g = medium["g"].number(-1, 1);
    if (std::abs(*settings.g) == 1) medium["g"].refuse("must lie between -1 and 1, both excluded");
  }
  return settings;
}

/// What read(path) makes of the file that a key names; faults of that file are told with the place of its
/// name.
template <typename Read>
auto fileAt(const Place& place, const char* key, std::vector<std::string>& files, const Read& read) {
  files.push_back(place.pathIn(key));
  try {
    return read(files.back());
  } catch (const InputError& error) {
    place[key].refuse(error.what());
  }
}

Mesh meshAt(const Place& place, Up up, std::vector<std::string>& files) {
  return fileAt(place, "mesh", files, [&](const std::string& path) { return readMesh(path, up); });
}

Light lightOf(const Place& light, Up up, std::vector<std::string>& files) {
  if (!light.value.is_object()) light.refuseType("an object { }");
  light.needs({"type"});
  const std::string type = light["type"].text();
  const auto onlyKeys = [&](std::vector<std::string> known) {
    known.insert(known.end(), {"type", "name", "group"});
    light.onlyKeys(known);
  };
  if (type == "sun") {
    onlyKeys({"direction", "irradiance", "angle"});
    light.needs({"direction"});
    return SunLight{light["direction"].direction(), light.rgbOr("irradiance", 1, kStrongestLight),
                    light.numberOr("angle", 0, 0, 180) * kDegree};
  }
  if (type == "point") {
    onlyKeys({"position", "intensity", "radius"});
    light.needs({"position"});
    return PointLight{light["position"].vector(), light.rgbOr("intensity", 1, kStrongestLight),
                      light.numberOr("radius", 0, 0, HUGE_VAL)};
  }
  if (type == "spot") {
    onlyKeys({"position", "direction", "intensity", "angle", "blend"});
    light.needs({"position", "direction"});
    SpotLight spot{light["position"].vector(), light["direction"].direction(),
                   light.rgbOr("intensity", 1, kStrongestLight)};
    spot.angle = light.numberOr("angle", 45, 0, 180) * kDegree;
    spot.blend = light.numberOr("blend", 0.15, 0, 1);
    if (spot.angle == 0) light["angle"].refuse("a cone of no width gives no light");
    return spot;
  }
  if (type == "area") {
    onlyKeys({"mesh", "radiance"});
    light.needs({"mesh"});
    return AreaLight{meshAt(light, up, files), light.rgbOr("radiance", 1, kStrongestLight)};
  }
  if (type == "dome") {
    onlyKeys({"radiance", "image", "rotation"});
    DomeLight dome{light.rgbOr("radiance", 1, kStrongestLight), nullptr,
                   light.numberOr("rotation", 0, -HUGE_VAL, HUGE_VAL) * kDegree};
    if (light.has("image"))
      dome.image = std::make_shared<const Image>(fileAt(light, "image", files, readExr));
    return dome;
  }
  light["type"].refuse("unknown light '" + printable(type) + "'" +
                       didYouMean(type, {"sun", "point", "spot", "area", "dome"}));
}

Surface surfaceOf(const Place& surface, Up up, std::vector<std::string>& files) {
  surface.onlyKeys({"mesh", "albedo", "name"});
  surface.needs({"mesh"});
  return {surface.textOr("name", ""), meshAt(surface, up, files), surface.rgbOr("albedo", 0, 1)};
}

}  // namespace

VolumeCut cutOf(const MediumSettings& settings) {
  return {settings.min_density.value_or(0), settings.crop};
}

Optics opticsOf(const MediumSettings& settings) {
  Optics optics;
  optics.sigma_s = settings.sigma_s.value_or(optics.sigma_s);
  optics.sigma_a = settings.sigma_a.value_or(optics.sigma_a);
  optics.g = settings.g.value_or(optics.g);
  optics.emission_scale = settings.emission_scale.value_or(optics.emission_scale);
  return optics;
}

SceneFile readSceneFile(const std::string& path, Up up) {
  const std::string extension = extensionOf(path);
  if (extension == ".gltf" || extension == ".glb") return {{}, readGltfScene(path, up), {path}};
  if (extension != ".json") throw InputError(path + ": scenes are read from .json, .gltf and .glb files");

  const nlohmann::json parsed = parseJson(readWholeFile(path, kLargestFile), path);
  const Place root{parsed, path, ""};
  root.onlyKeys({"medium", "lights", "surfaces"});
  SceneFile file;
  file.files.push_back(path);
  if (root.has("medium")) file.medium = mediumOf(root["medium"]);
  for (const char* key : {"lights", "surfaces"}) {
    if (!root.has(key)) continue;
    const Place list = root[key];
    if (!list.value.is_array()) list.refuseType("a list [ ]");
    for (size_t i = 0; i < list.value.size(); ++i) {
      const Place item = list[i];
      if (key == std::string("lights"))
        file.scene.lights.push_back(
            {item.textOr("name", ""), lightOf(item, up, file.files), item.textOr("group", "")});
      else
        file.scene.surfaces.push_back(surfaceOf(item, up, file.files));
    }
  }
  return file;
}

}  // namespace vdb_diffuse
