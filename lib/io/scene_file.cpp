#include "io/scene_file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <numeric>

#include "grid/error.h"
#include "io/gltf_scene.h"
#include "io/image.h"
#include "io/json_file.h"

namespace vdb_diffuse {
namespace {

using nlohmann::json;

constexpr size_t kLargestFile = 16 << 20;  // bytes; meshes and images lie in files of their own
constexpr double kDegree = 3.14159265358979323846 / 180;

size_t editDistance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (size_t i = 0; i < a.size(); ++i) {
    size_t diagonal = row[0]++;
    for (size_t j = 0; j < b.size(); ++j) {
      const size_t substitution = diagonal + (a[i] != b[j]);
      diagonal = row[j + 1];
      row[j + 1] = std::min({substitution, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

std::string nearest(const std::string& word, const std::vector<std::string>& known) {
  const auto best = std::min_element(known.begin(), known.end(), [&](const auto& a, const auto& b) {
    return editDistance(word, a) < editDistance(word, b);
  });
  if (best != known.end() && editDistance(word, *best) <= std::max<size_t>(2, best->size() / 3))
    return ", did you mean '" + *best + "'?";
  std::string list = "; known:";
  for (const std::string& k : known) list += ' ' + k;
  return list;
}

/// A value inside the file that knows where it stands, for messages.
struct Place {
  const json& value;
  const std::string& file;
  std::string at;  // "lights[2].angle"

  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError(file + ": " + (at.empty() ? "" : at + ": ") + what);
  }
  [[noreturn]] void refuseType(const std::string& expected) const {
    std::string found = value.dump(-1, ' ', true, json::error_handler_t::replace);
    if (found.size() > 40) found = found.substr(0, 37) + "...";
    refuse("expected " + expected + ", found " + found);
  }
  bool has(const char* key) const { return value.contains(key); }
  Place operator[](const std::string& key) const {
    return {value[key], file, at.empty() ? key : at + "." + key};
  }
  Place operator[](size_t i) const { return {value[i], file, at + "[" + std::to_string(i) + "]"}; }

  void onlyKeys(const std::vector<std::string>& known) const {
    if (!value.is_object()) refuseType("an object { }");
    for (const auto& item : value.items())
      if (std::find(known.begin(), known.end(), item.key()) == known.end())
        refuse("unknown key '" + printable(item.key()) + "'" + nearest(item.key(), known));
  }
  void needs(std::initializer_list<const char*> keys) const {
    for (const char* key : keys)
      if (!has(key)) refuse("needs '" + std::string(key) + "'");
  }

  std::string text() const {
    if (!value.is_string()) refuseType("a text");
    return value.get<std::string>();
  }
  double number(double lowest = -HUGE_VAL, double highest = HUGE_VAL) const {
    if (!value.is_number()) refuseType("a number");
    const double x = value.get<double>();
    if (!std::isfinite(x)) refuse("not finite");
    if (x < lowest || x > highest) {
      const auto shown = [](double v) { return json(v).dump(); };
      refuse(shown(x) + (highest == HUGE_VAL ? " is less than " + shown(lowest)
                                             : " is not from " + shown(lowest) + " to " + shown(highest)));
    }
    return x;
  }
  Vec3d vector() const {
    if (!value.is_array() || value.size() != 3) refuseType("three numbers [x, y, z]");
    return Vec3d((*this)[size_t(0)].number(), (*this)[size_t(1)].number(), (*this)[size_t(2)].number());
  }
  Vec3d direction() const {
    const Vec3d v = vector();
    const double scale = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
    if (scale == 0) refuse("a direction cannot be zero");
    return (v / scale).unit();  // first to about 1, as a square may underflow or overflow
  }
  Vec3d rgb(double highest = HUGE_VAL) const {
    if (value.is_number()) return Vec3d(number(0, highest));
    if (!value.is_array() || value.size() != 3) refuseType("a number or three [r, g, b]");
    return Vec3d((*this)[size_t(0)].number(0, highest), (*this)[size_t(1)].number(0, highest),
                 (*this)[size_t(2)].number(0, highest));
  }
  Vec3d rgbOr(const char* key, double fallback, double highest = HUGE_VAL) const {
    return has(key) ? (*this)[key].rgb(highest) : Vec3d(fallback);
  }
  double numberOr(const char* key, double fallback, double lowest, double highest) const {
    return has(key) ? (*this)[key].number(lowest, highest) : fallback;
  }
  std::string pathIn(const char* key) const {
    return (std::filesystem::path(file).parent_path() / (*this)[key].text()).string();
  }
  std::string name() const { return has("name") ? (*this)["name"].text() : ""; }
};

MediumSettings mediumOf(const Place& medium) {
  medium.onlyKeys({"density", "sigma_s", "sigma_a", "sigma_t", "albedo", "g", "emission", "emission_scale"});
  MediumSettings settings;
  if (medium.has("density")) settings.density = medium["density"].text();
  if (medium.has("emission")) settings.emission = medium["emission"].text();
  if (medium.has("emission_scale")) settings.emission_scale = medium["emission_scale"].number(0);
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

Light lightOf(const Place& light, Up up) {
  if (!light.value.is_object()) light.refuseType("an object { }");
  light.needs({"type"});
  const std::string type = light["type"].text();
  const auto onlyKeys = [&](std::vector<std::string> known) {
    known.insert(known.end(), {"type", "name"});
    light.onlyKeys(known);
  };
  if (type == "sun") {
    onlyKeys({"direction", "irradiance", "angle"});
    light.needs({"direction"});
    return SunLight{light["direction"].direction(), light.rgbOr("irradiance", 1),
                    light.numberOr("angle", 0, 0, 180) * kDegree};
  }
  if (type == "point") {
    onlyKeys({"position", "intensity", "radius"});
    light.needs({"position"});
    return PointLight{light["position"].vector(), light.rgbOr("intensity", 1),
                      light.numberOr("radius", 0, 0, HUGE_VAL)};
  }
  if (type == "spot") {
    onlyKeys({"position", "direction", "intensity", "angle", "blend"});
    light.needs({"position", "direction"});
    SpotLight spot{light["position"].vector(), light["direction"].direction(), light.rgbOr("intensity", 1)};
    spot.angle = light.numberOr("angle", 45, 0, 180) * kDegree;
    spot.blend = light.numberOr("blend", 0.15, 0, 1);
    if (spot.angle == 0) light["angle"].refuse("a cone of no width gives no light");
    return spot;
  }
  if (type == "area") {
    onlyKeys({"mesh", "radiance"});
    light.needs({"mesh"});
    return AreaLight{readMesh(light.pathIn("mesh"), up), light.rgbOr("radiance", 1)};
  }
  if (type == "dome") {
    onlyKeys({"radiance", "image", "rotation"});
    DomeLight dome{light.rgbOr("radiance", 1), nullptr,
                   light.numberOr("rotation", 0, -HUGE_VAL, HUGE_VAL) * kDegree};
    if (light.has("image")) dome.image = std::make_shared<const Image>(readExr(light.pathIn("image")));
    return dome;
  }
  light["type"].refuse("unknown light '" + printable(type) + "'" +
                       nearest(type, {"sun", "point", "spot", "area", "dome"}));
}

Surface surfaceOf(const Place& surface, Up up) {
  surface.onlyKeys({"mesh", "albedo", "name"});
  surface.needs({"mesh"});
  return {surface.name(), readMesh(surface.pathIn("mesh"), up), surface.rgbOr("albedo", 0, 1)};
}

}  // namespace

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
  if (extension == ".gltf" || extension == ".glb") return {{}, readGltfScene(path, up)};
  if (extension != ".json") throw InputError(path + ": scenes are read from .json, .gltf and .glb files");

  const json parsed = parseJson(readWholeFile(path, kLargestFile), path);
  const Place root{parsed, path, ""};
  root.onlyKeys({"medium", "lights", "surfaces"});
  SceneFile file;
  if (root.has("medium")) file.medium = mediumOf(root["medium"]);
  for (const char* key : {"lights", "surfaces"}) {
    if (!root.has(key)) continue;
    const Place list = root[key];
    if (!list.value.is_array()) list.refuseType("a list [ ]");
    for (size_t i = 0; i < list.value.size(); ++i) {
      const Place item = list[i];
      if (key == std::string("lights"))
        file.scene.lights.push_back({item.name(), lightOf(item, up)});
      else
        file.scene.surfaces.push_back(surfaceOf(item, up));
    }
  }
  return file;
}

}  // namespace vdb_diffuse
