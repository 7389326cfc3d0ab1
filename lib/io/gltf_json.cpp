#include "io/gltf_json.h"

#include <algorithm>
#include <map>
#include <vector>

#include "grid/error.h"
#include "io/json_file.h"
#include "io/mesh_file.h"

namespace vdb_diffuse {
namespace {

/// The text of a .glb: a header of 12 bytes, then the JSON chunk as length, "JSON", text.
std::string jsonChunk(const std::string& bytes, const std::string& path) {
  const auto word = [&](size_t at) {
    uint32_t value = 0;
    for (int i = 3; i >= 0; --i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
    return value;
  };
  if (bytes.size() < 20 || bytes.compare(0, 4, "glTF") != 0 || bytes.compare(16, 4, "JSON") != 0)
    throw InputError(path + ": not a GLB file");
  if (word(4) != 2) throw InputError(path + ": glTF version " + std::to_string(word(4)) + ", not 2");
  if (word(12) > bytes.size() - 20) throw InputError(path + ": truncated");
  return bytes.substr(20, word(12));
}

using Json = nlohmann::json;

/// Holds what accessors and buffer views say of sizes and places against each other, so that no reader is led
/// beyond a buffer.
class Ranges {
 public:
  Ranges(const Json& gltf, const std::string& path) : gltf_(gltf), path_(path) {}

  void check() const {
    forEach("bufferViews", [&](const Json& view, const std::string& place) {
      const uint64_t end = add(number(view, "byteOffset", place), number(view, "byteLength", place));
      const uint64_t stride = number(view, "byteStride", place);
      if (stride > 252) refuse(place + ".byteStride is " + std::to_string(stride) + ", more than 252");
      if (const Json* buffer = referred(view, "buffer", "buffers", place))
        if (end > number(*buffer, "byteLength", place + ".buffer")) refuse(place + " ends beyond its buffer");
    });
    forEach("accessors", [&](const Json& accessor, const std::string& place) {
      if (accessor.contains("sparse"))
        refuse(place + " is sparse, which is not read; export without sparse accessors");
      const uint64_t count = number(accessor, "count", place);
      if (count > 3 * kMostTriangles) refuse(place + " has " + std::to_string(count) + " elements");
      const Json* view = referred(accessor, "bufferView", "bufferViews", place);
      if (!view || count == 0) return;
      const uint64_t size = sizeOf(accessor, place), stride = number(*view, "byteStride", place);
      const uint64_t end =
          add(number(accessor, "byteOffset", place), (count - 1) * std::max(stride, size) + size);
      if (end > number(*view, "byteLength", place)) refuse(place + " ends beyond its buffer view");
    });
  }

 private:
  const Json& gltf_;
  const std::string& path_;

  [[noreturn]] void refuse(const std::string& what) const { throw InputError(path_ + ": " + what); }

  template <typename Body>
  void forEach(const char* list, const Body& body) const {
    if (!gltf_.contains(list)) return;
    for (size_t i = 0; i < gltf_[list].size(); ++i) {
      const std::string place = std::string(list) + "[" + std::to_string(i) + "]";
      if (!gltf_[list][i].is_object()) refuse(place + " is not an object");
      body(gltf_[list][i], place);
    }
  }
  /// A size or place in bytes; 0 where nothing is said.
  uint64_t number(const Json& object, const char* key, const std::string& place) const {
    if (!object.contains(key)) return 0;
    if (!object[key].is_number_unsigned())
      refuse(place + "." + key + " is no count: " + printable(object[key].dump()));
    return object[key].get<uint64_t>();
  }
  uint64_t add(uint64_t a, uint64_t b) const {
    if (a > UINT64_MAX - b) refuse("bytes beyond any buffer");
    return a + b;
  }
  /// What an index refers to; null where there is no index.
  const Json* referred(const Json& object, const char* key, const char* list,
                       const std::string& place) const {
    if (!object.contains(key)) return nullptr;
    const uint64_t index = number(object, key, place);
    if (!gltf_.contains(list) || index >= gltf_[list].size() || !gltf_[list][index].is_object())
      refuse(place + "." + key + ": there is no " + list + "[" + std::to_string(index) + "]");
    return &gltf_[list][index];
  }
  uint64_t sizeOf(const Json& accessor, const std::string& place) const {
    static const std::map<uint64_t, uint64_t> kComponents{{5120, 1}, {5121, 1}, {5122, 2},
                                                          {5123, 2}, {5125, 4}, {5126, 4}};
    static const std::map<std::string, uint64_t> kTypes{{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4},
                                                        {"MAT2", 4},   {"MAT3", 9}, {"MAT4", 16}};
    const auto component = kComponents.find(number(accessor, "componentType", place));
    if (component == kComponents.end()) refuse(place + " has no known componentType");
    if (!accessor.contains("type") || !accessor["type"].is_string()) refuse(place + " has no type");
    const auto type = kTypes.find(accessor["type"].get<std::string>());
    if (type == kTypes.end()) refuse(place + " has no known type");
    return component->second * type->second;
  }
};

}  // namespace

nlohmann::json readGltfJson(const std::string& path) {
  std::string bytes = readWholeFile(path, kLargestMeshFile);
  if (extensionOf(path) == ".glb") bytes = jsonChunk(bytes, path);
  nlohmann::json gltf = parseJson(bytes, path);  // not const, to be moved out
  const auto refuse = [&](const std::string& what) { throw InputError(path + ": " + what); };
  const auto version = nlohmann::json::json_pointer("/asset/version");
  if (!gltf.is_object() || !gltf.contains(version) || !gltf[version].is_string())
    refuse("not glTF: asset.version is missing");
  if (gltf[version].get<std::string>().rfind("2.", 0) != 0)
    refuse("glTF version " + gltf[version].get<std::string>() + ", not 2");
  for (const char* key : {"nodes", "scenes", "meshes", "materials", "accessors", "buffers", "bufferViews"})
    if (gltf.contains(key) && !gltf[key].is_array()) refuse(std::string(key) + " is not an array");
  Ranges(gltf, path).check();
  if (!gltf.contains("nodes")) return gltf;

  // The specification's "strict trees": without this, 40 nodes can name 2^40 instances, or a cycle.
  const auto& nodes = gltf["nodes"];
  if (nodes.size() > kMostGltfNodes) refuse("more than " + std::to_string(kMostGltfNodes) + " nodes");
  std::vector<int64_t> parent(nodes.size(), -1);
  for (size_t i = 0; i < nodes.size(); ++i) {
    if (!nodes[i].is_object()) refuse("nodes[" + std::to_string(i) + "] is not an object");
    if (!nodes[i].contains("children")) continue;
    const auto& children = nodes[i]["children"];
    const std::string place = "nodes[" + std::to_string(i) + "].children";
    if (!children.is_array()) refuse(place + " is not an array");
    for (const auto& child : children) {
      if (!child.is_number_unsigned() || child.get<uint64_t>() >= nodes.size())
        refuse(place + ": no such node");
      int64_t& its = parent[child.get<size_t>()];
      if (its >= 0) refuse("node " + child.dump() + " has two parents");
      its = static_cast<int64_t>(i);
    }
  }
  for (size_t i = 0; i < nodes.size(); ++i) {
    int depth = 0;
    for (int64_t n = static_cast<int64_t>(i); n >= 0; n = parent[n])
      if (++depth > kDeepestGltfNode)
        refuse("nodes nested deeper than " + std::to_string(kDeepestGltfNode) + ", or a cycle");
  }
  if (!gltf.contains("scenes")) return gltf;
  for (const auto& scene : gltf["scenes"]) {
    if (!scene.is_object() || !scene.contains("nodes")) continue;
    if (!scene["nodes"].is_array()) refuse("a scene's nodes are not an array");
    std::vector<bool> named(nodes.size(), false);
    for (const auto& root : scene["nodes"]) {
      if (!root.is_number_unsigned() || root.get<uint64_t>() >= nodes.size())
        refuse("a scene names no such node");
      const size_t n = root.get<size_t>();
      if (parent[n] >= 0 || named[n]) refuse("a scene names node " + root.dump() + " twice");
      named[n] = true;
    }
  }
  return gltf;
}

}  // namespace vdb_diffuse
