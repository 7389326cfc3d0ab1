#include "io/scene_file.h"

#include <cmath>
#include <map>

#include "grid/error.h"
#include "io/gltf_json.h"
#include "io/gltf_scene.h"
#include "io/image.h"
#include "io/json_file.h"
#include "io/json_place.h"

namespace vdb_diffuse {
namespace {

constexpr size_t kLargestFile = 16 << 20;  // bytes; meshes and images lie in files of their own
constexpr size_t kMostCopied = 256 << 20;  // bytes of meshes that are named more than once
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

/// The files that a scene names. Each is read once, and what is kept of them is bounded, however often a
/// small scene names a large file.
class NamedFiles {
 public:
  explicit NamedFiles(Up up) : up_(up) {}

  std::vector<std::string> paths;  ///< of what was named, in this order

  Mesh meshAt(const Place& place) {
    const size_t read_before = meshes_.size();
    const Mesh& mesh =
        once(meshes_, place, "mesh", [&](const std::string& path) { return readMesh(path, up_); });
    if ((triangles_ += mesh.triangles.size()) > kMostTriangles)
      place["mesh"].refuse("the scene has more than " + std::to_string(kMostTriangles) + " triangles");
    if (meshes_.size() == read_before)
      copied_ +=
          mesh.triangles.size() * sizeof mesh.triangles[0] + mesh.positions.size() * sizeof mesh.positions[0];
    if (copied_ > kMostCopied)
      place["mesh"].refuse("meshes that the scene names again take more than " +
                           std::to_string(kMostCopied >> 20) + " MB");
    return mesh;
  }
  std::shared_ptr<const Image> imageAt(const Place& place) {
    return once(images_, place, "image", [&](const std::string& path) {
      auto image = std::make_shared<const Image>(readExr(path));
      if ((pixels_ += image->pixels.size()) > 2 * kMaxImagePixels)
        throw InputError(path + ": the scene's pictures have more than " +
                         std::to_string(2 * kMaxImagePixels) + " pixels");
      return image;
    });
  }

 private:
  Up up_;
  std::map<std::string, Mesh> meshes_;
  std::map<std::string, std::shared_ptr<const Image>> images_;
  size_t triangles_ = 0, copied_ = 0, pixels_ = 0;

  /// What read(path) makes of the file that a key names, read or read before; faults of that file are told
  /// with the place of its name.
  template <typename Kept, typename Read>
  const Kept& once(std::map<std::string, Kept>& kept, const Place& place, const char* key, const Read& read) {
    paths.push_back(place.pathIn(key));
    const auto found = kept.find(paths.back());
    if (found != kept.end()) return found->second;
    try {
      return kept.emplace(paths.back(), read(paths.back())).first->second;
    } catch (const InputError& error) {
      place[key].refuse(error.what());
    }
  }
};

Light lightOf(const Place& light, NamedFiles& files) {
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
    return AreaLight{files.meshAt(light), light.rgbOr("radiance", 1, kStrongestLight)};
  }
  if (type == "dome") {
    onlyKeys({"radiance", "image", "rotation"});
    DomeLight dome{light.rgbOr("radiance", 1, kStrongestLight), nullptr,
                   light.numberOr("rotation", 0, -HUGE_VAL, HUGE_VAL) * kDegree};
    if (light.has("image")) dome.image = files.imageAt(light);
    return dome;
  }
  light["type"].refuse("unknown light '" + printable(type) + "'" +
                       didYouMean(type, {"sun", "point", "spot", "area", "dome"}));
}

Surface surfaceOf(const Place& surface, NamedFiles& files) {
  surface.onlyKeys({"mesh", "albedo", "name"});
  surface.needs({"mesh"});
  return {surface.textOr("name", ""), files.meshAt(surface), surface.rgbOr("albedo", 0, 1)};
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
  NamedFiles files(up);
  if (root.has("medium")) file.medium = mediumOf(root["medium"]);
  for (const char* key : {"lights", "surfaces"}) {
    if (!root.has(key)) continue;
    const Place list = root[key];
    if (!list.value.is_array()) list.refuseType("a list [ ]");
    if (key == std::string("surfaces")) file.scene.surfaces.reserve(list.value.size());
    for (size_t i = 0; i < list.value.size(); ++i) {
      const Place item = list[i];
      if (key == std::string("lights"))
        file.scene.lights.push_back(
            {item.textOr("name", ""), lightOf(item, files), item.textOr("group", "")});
      else
        file.scene.surfaces.push_back(surfaceOf(item, files));
    }
  }
  file.files = std::move(files.paths);
  file.files.insert(file.files.begin(), path);
  return file;
}

}  // namespace vdb_diffuse
