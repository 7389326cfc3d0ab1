#include "io/gltf_scene.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "grid/error.h"
#include "io/gltf_json.h"
#include "io/json_file.h"
#include "io/mesh_import.h"

namespace vdb_diffuse {
namespace {

using nlohmann::json;

constexpr double kLumensPerWatt = 683;  // glTF is photometric; the factor every exporter agrees on
constexpr double kPi = 3.14159265358979323846;

/// Reads the parts that assimp leaves out or blurs (a light in two nodes, emissive strength).
class Reader {
 public:
  Reader(const std::string& path, Up up) : path_(path), up_(up), gltf_(readGltfJson(path)) {}

  std::vector<NamedLight> lights() const;
  double emissiveStrength(const ImportedMaterial& material) const;

 private:
  /// A node's axes and place in the world: columns x, y, z and the origin.
  using Frame = std::array<Vec3d, 4>;
  static Vec3d turn(const Frame& f, const Vec3d& v) { return f[0] * v[0] + f[1] * v[1] + f[2] * v[2]; }
  static Frame compose(const Frame& outer, const Frame& inner) {
    return {turn(outer, inner[0]), turn(outer, inner[1]), turn(outer, inner[2]),
            turn(outer, inner[3]) + outer[3]};
  }

  [[noreturn]] void refuse(const std::string& what) const { throw InputError(path_ + ": " + what); }
  std::vector<double> numbers(const json& object, const char* key, std::vector<double> fallback) const;
  double number(const json& object, const char* key, double fallback) const;
  Frame localFrame(const json& node) const;
  NamedLight light(const json& definition, const Frame& frame, const std::string& name) const;

  std::string path_;
  Up up_;
  json gltf_;
};

std::vector<double> Reader::numbers(const json& object, const char* key, std::vector<double> fallback) const {
  if (!object.contains(key)) return fallback;
  const json& values = object[key];
  if (!values.is_array() || values.size() != fallback.size())
    refuse(std::string(key) + ": expected " + std::to_string(fallback.size()) + " numbers");
  for (size_t i = 0; i < fallback.size(); ++i) {
    if (!values[i].is_number()) refuse(std::string(key) + ": expected numbers");
    fallback[i] = values[i].get<double>();
  }
  return fallback;
}

double Reader::number(const json& object, const char* key, double fallback) const {
  if (!object.contains(key)) return fallback;
  if (!object[key].is_number()) refuse(std::string(key) + ": expected a number");
  return object[key].get<double>();
}

Reader::Frame Reader::localFrame(const json& node) const {
  if (node.contains("matrix")) {  // column by column
    const auto m = numbers(node, "matrix", std::vector<double>(16));
    return {Vec3d(m[0], m[1], m[2]), Vec3d(m[4], m[5], m[6]), Vec3d(m[8], m[9], m[10]),
            Vec3d(m[12], m[13], m[14])};
  }
  const auto t = numbers(node, "translation", {0, 0, 0}), s = numbers(node, "scale", {1, 1, 1});
  const auto q = numbers(node, "rotation", {0, 0, 0, 1});
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  return {Vec3d(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)) * s[0],
          Vec3d(2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)) * s[1],
          Vec3d(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)) * s[2],
          Vec3d(t[0], t[1], t[2])};
}

NamedLight Reader::light(const json& definition, const Frame& frame, const std::string& name) const {
  const auto refuseLight = [&](const std::string& what) {
    refuse("light '" + printable(name) + "': " + what);
  };
  if (!definition.is_object() || !definition.contains("type") || !definition["type"].is_string())
    refuseLight("has no type");
  const std::string type = definition["type"];
  const auto color = numbers(definition, "color", {1, 1, 1});
  const Vec3d strength =
      Vec3d(color[0], color[1], color[2]) * (number(definition, "intensity", 1) / kLumensPerWatt);
  for (int a = 0; a < 3; ++a)
    if (!(strength[a] >= 0 && strength[a] <= kStrongestLight))
      refuseLight("intensity times color must be from 0 to 1e30");
  const Vec3d position = fromYUp(frame[3], up_), along = fromYUp(-frame[2], up_);
  for (int a = 0; a < 3; ++a)
    if (!std::isfinite(position[a])) refuseLight("its position is not finite");
  if (type == "point") return {name, PointLight{position, strength, 0}};

  if (!(along.length() > 0) || !std::isfinite(along.length())) refuseLight("its node has no direction");
  if (type == "directional") return {name, SunLight{along.unit(), strength, 0}};
  if (type != "spot") refuseLight("unknown type '" + printable(type) + "'");
  const json cones = definition.value("spot", json::object());
  const double inner = number(cones, "innerConeAngle", 0), outer = number(cones, "outerConeAngle", kPi / 4);
  // Writers round pi/2 to float, which is larger.
  if (!(0 <= inner && inner <= outer && outer > 0 && outer < kPi / 2 + 1e-6))
    refuseLight("cone angles must be 0 <= inner <= outer <= pi/2");
  const double cos_outer = std::cos(outer);
  return {name, SpotLight{position, along.unit(), strength, 2 * outer,
                          (std::cos(inner) - cos_outer) / (1 - cos_outer)}};
}

std::vector<NamedLight> Reader::lights() const {
  const json::json_pointer definitions_at("/extensions/KHR_lights_punctual/lights");
  const json::json_pointer reference_at("/extensions/KHR_lights_punctual/light");
  std::vector<NamedLight> lights;
  if (!gltf_.contains(definitions_at) || !gltf_.contains("nodes") || !gltf_.contains("scenes")) return lights;
  const json &definitions = gltf_[definitions_at], &nodes = gltf_["nodes"], &scenes = gltf_["scenes"];
  const double scene = number(gltf_, "scene", 0);
  if (!(scene >= 0 && scene < static_cast<double>(scenes.size()))) refuse("no such scene");
  const json& shown = scenes[static_cast<size_t>(scene)];
  if (!shown.is_object() || !shown.contains("nodes")) return lights;

  const Frame world{Vec3d(1, 0, 0), Vec3d(0, 1, 0), Vec3d(0, 0, 1), Vec3d(0, 0, 0)};
  std::vector<std::pair<size_t, Frame>> open;  // indices checked: each node has one parent at most
  const auto push = [&](const json& indices, const Frame& frame) {
    for (auto i = indices.rbegin(); i != indices.rend(); ++i) open.emplace_back(i->get<size_t>(), frame);
  };
  push(shown["nodes"], world);
  while (!open.empty()) {
    const json& node = nodes[open.back().first];
    const Frame frame = compose(open.back().second, localFrame(node));
    open.pop_back();
    if (node.contains(reference_at)) {
      const json& reference = node[reference_at];
      if (!definitions.is_array() || !reference.is_number_unsigned() ||
          reference.get<uint64_t>() >= definitions.size())
        refuse("a node names no such light");
      const json& definition = definitions[reference.get<size_t>()];
      const json& named = node.contains("name") ? node : definition;
      const bool has_name = named.is_object() && named.contains("name") && named["name"].is_string();
      lights.push_back(light(definition, frame, has_name ? named["name"].get<std::string>() : ""));
    }
    if (node.contains("children")) push(node["children"], frame);
  }
  return lights;
}

double Reader::emissiveStrength(const ImportedMaterial& material) const {
  // assimp 5.2 does not read the extension and sorts the materials, so they are told apart by name.
  const json::json_pointer strength_at("/extensions/KHR_materials_emissive_strength/emissiveStrength");
  double strength = 1;
  bool found = false;
  if (!gltf_.contains("materials")) return strength;
  for (const json& m : gltf_["materials"]) {
    if (!m.is_object()) continue;
    const std::string its_name =
        m.contains("name") && m["name"].is_string() ? m["name"].get<std::string>() : "";
    if (its_name != material.name) continue;
    double its = 1;
    if (m.contains(strength_at)) {
      if (!m[strength_at].is_number() || !(m[strength_at].get<double>() >= 0))
        refuse("material '" + printable(material.name) + "': emissiveStrength must be 0 or more");
      its = m[strength_at].get<double>();
    }
    if (found && its != strength)
      refuse("two materials named '" + printable(material.name) +
             "' differ in emissiveStrength: give them different names");
    strength = its;
    found = true;
  }
  return strength;
}

}  // namespace

Scene readGltfScene(const std::string& path, Up up) {
  const Reader reader(path, up);
  Scene scene;
  scene.lights = reader.lights();
  ImportedFile file = importMeshes(path, up);
  for (ImportedMesh& part : file.meshes) {
    const ImportedMaterial& material = file.materials[part.material];
    const auto refuse = [&](const std::string& what) {
      throw InputError(path + ": material '" + printable(material.name) + "': " + what);
    };
    for (int a = 0; a < 3; ++a) {
      if (!(material.base_color[a] >= 0 && material.base_color[a] <= 1)) refuse("base colour must be 0 to 1");
      if (!(material.emissive[a] >= 0) || !std::isfinite(material.emissive[a]))
        refuse("emission must be 0 or more");
    }
    const Vec3d radiance = material.emissive * reader.emissiveStrength(material);
    if (!(std::max({radiance[0], radiance[1], radiance[2]}) <= kStrongestLight))
      refuse("emission must be at most 1e30");
    if (material.emissive == Vec3d(0))
      scene.surfaces.push_back({part.name, std::move(part.mesh), material.base_color});
    else
      scene.lights.push_back({part.name, AreaLight{std::move(part.mesh), radiance}});
  }
  return scene;
}

}  // namespace vdb_diffuse
