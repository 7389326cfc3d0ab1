#include "io/plain_gltf.h"

#include <algorithm>
#include <filesystem>

#include "grid/error.h"
#include "io/gltf_json.h"
#include "io/json_file.h"
#include "io/mesh_file.h"

namespace vdb_diffuse {
namespace {

using nlohmann::json;

constexpr size_t kLongestName = 200;

/// Copies members, those that are there; names are cut.
void take(const json& from, json& to, std::initializer_list<const char*> keys) {
  for (const char* key : keys) {
    if (!from.contains(key)) continue;
    if (std::string(key) != "name")
      to[key] = from[key];
    else if (from[key].is_string())
      to[key] = from[key].get<std::string>().substr(0, kLongestName);
  }
}

class Plain {
 public:
  Plain(const json& gltf, const std::string& path) : gltf_(gltf), path_(path) {}

  json made() {
    json plain = {{"asset", {{"version", "2.0"}}}};
    take(gltf_, plain, {"scene", "bufferViews"});
    plain["scenes"] = each("scenes", [](const json& from, json& to) { take(from, to, {"nodes"}); });
    plain["nodes"] = each("nodes", [](const json& from, json& to) {
      take(from, to, {"name", "children", "matrix", "translation", "rotation", "scale", "mesh"});
    });
    plain["materials"] = each("materials", [](const json& from, json& to) {
      take(from, to, {"name", "emissiveFactor"});
      const json::json_pointer base("/pbrMetallicRoughness/baseColorFactor");
      if (from.contains(base)) to[base] = from[base];
    });
    plain["accessors"] = each("accessors", [](const json& from, json& to) {
      take(from, to, {"bufferView", "byteOffset", "componentType", "count", "type"});
    });
    plain["buffers"] = each("buffers", [this](const json& from, json& to) { buffer(from, to); });
    plain["meshes"] = each("meshes", [this](const json& from, json& to) { mesh(from, to); });
    return plain;
  }

 private:
  const json& gltf_;
  const std::string& path_;
  uint64_t corners_ = 0;  // of all primitives, however many share their indices

  [[noreturn]] void refuse(const std::string& what) const { throw InputError(path_ + ": " + what); }

  template <typename Fill>
  json each(const char* list, const Fill& fill) const {
    json items = json::array();
    if (!gltf_.contains(list)) return items;
    for (const json& from : gltf_[list]) {
      if (!from.is_object()) refuse(std::string(list) + " holds what is not an object");
      json to = json::object();
      fill(from, to);
      items.push_back(std::move(to));
    }
    return items;
  }

  /// A data URI's media type is told by no one but itself.
  void buffer(const json& from, json& to) const {
    take(from, to, {"byteLength", "uri"});
    if (!to.contains("uri")) return;
    if (!to["uri"].is_string()) refuse("a buffer's uri is not text");
    const std::string uri = to["uri"];
    const size_t comma = uri.find(',');
    if (uri.rfind("data:", 0) != 0) return besideIt(uri, from.value("byteLength", uint64_t{0}));
    if (comma == std::string::npos || comma < 12 || uri.compare(comma - 7, 7, ";base64") != 0)
      refuse("a buffer's data are not in base64");
    to["uri"] = "data:application/octet-stream;base64" + uri.substr(comma);
  }

  void besideIt(const std::string& uri, uint64_t length) const {
    if (uri.find('%') != std::string::npos) return;  // written otherwise than the file is named
    const std::filesystem::path file = std::filesystem::path(path_).parent_path() / uri;
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) refuse(printable(uri) + ": no such file");
    const uintmax_t size = std::filesystem::file_size(file, error);
    if (!error && size < length)
      refuse(printable(uri) + " has " + std::to_string(size) + " bytes, not the " + std::to_string(length) +
             " of the buffer");
  }

  /// The accessor that an index refers to.
  const json& accessor(const json& primitive, const char* key, const std::string& place) const {
    const json& index = primitive[key];
    if (!gltf_.contains("accessors") || !index.is_number_unsigned() ||
        index.get<uint64_t>() >= gltf_["accessors"].size())
      refuse(place + "." + key + ": there is no such accessor");
    const json& found = gltf_["accessors"][index.get<size_t>()];
    if (!found.contains("bufferView"))
      refuse(place + "." + key + " has no data, or compressed ones; export without compression");
    return found;
  }

  static bool has(const json& accessor, const char* type, std::initializer_list<int> components) {
    return accessor.value("type", "") == type &&
           std::count(components.begin(), components.end(), accessor.value("componentType", 0)) > 0;
  }

  void mesh(const json& from, json& to) {
    take(from, to, {"name"});
    to["primitives"] = json::array();
    if (!from.contains("primitives") || !from["primitives"].is_array()) refuse("a mesh without primitives");
    for (const json& primitive : from["primitives"]) {
      if (!primitive.is_object()) refuse("a primitive is not an object");
      const json& mode = primitive.value("mode", json(4u));
      if (!mode.is_number_unsigned() || mode.get<uint64_t>() > 6) refuse("a primitive of no known mode");
      const json& attributes = primitive.value("attributes", json::object());
      if (mode.get<int>() < 4 || !attributes.is_object() || !attributes.contains("POSITION")) continue;
      const json& positions = accessor(attributes, "POSITION", "attributes");
      if (!has(positions, "VEC3", {5126}))
        refuse("positions are not three floats each; export without quantization");
      uint64_t corners = positions.value("count", uint64_t{0});
      json kept = {{"attributes", {{"POSITION", attributes["POSITION"]}}}, {"mode", mode}};
      if (primitive.contains("indices")) {
        const json& indices = accessor(primitive, "indices", "primitive");
        if (!has(indices, "SCALAR", {5121, 5123, 5125}))
          refuse("a primitive's indices are not whole numbers");
        corners = indices.value("count", uint64_t{0});
        kept["indices"] = primitive["indices"];
      }
      if (corners < 3 || positions.value("count", uint64_t{0}) == 0) continue;
      if ((corners_ += corners) > 3 * kMostTriangles)
        refuse("more than " + std::to_string(kMostTriangles) + " triangles");
      material(primitive, kept);
      to["primitives"].push_back(std::move(kept));
    }
  }

  void material(const json& primitive, json& kept) const {
    if (!primitive.contains("material")) return;
    const json& index = primitive["material"];
    if (!gltf_.contains("materials") || !index.is_number_unsigned() ||
        index.get<uint64_t>() >= gltf_["materials"].size())
      refuse("a primitive names no such material");
    kept["material"] = index;
  }
};

std::string word(size_t value) {
  std::string bytes;
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(value >> 8 * i & 0xff);
  return bytes;
}

}  // namespace

std::string plainGltf(const json& gltf, const std::string& path) {
  std::string text = Plain(gltf, path).made().dump();
  if (extensionOf(path) != ".glb") return text;
  const std::string bytes = readWholeFile(path, kLargestMeshFile);
  size_t length = 0;  // of the JSON chunk, which readGltfJson has found within the file
  for (int i = 3; i >= 0; --i) length = length << 8 | static_cast<unsigned char>(bytes[12 + i]);
  text.append((4 - text.size() % 4) % 4, ' ');
  const std::string rest = bytes.substr(20 + length);
  return "glTF" + word(2) + word(20 + text.size() + rest.size()) + word(text.size()) + "JSON" + text + rest;
}

}  // namespace vdb_diffuse
