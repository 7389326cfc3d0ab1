#include "io/gltf_json.h"

#include <vector>

#include "grid/error.h"
#include "io/json_file.h"

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

}  // namespace

nlohmann::json readGltfJson(const std::string& path) {
  std::string bytes = readWholeFile(path, kLargestMeshFile);
  if (extensionOf(path) == ".glb") bytes = jsonChunk(bytes, path);
  const nlohmann::json gltf = parseJson(bytes, path);
  const auto refuse = [&](const std::string& what) { throw InputError(path + ": " + what); };
  const auto version = nlohmann::json::json_pointer("/asset/version");
  if (!gltf.is_object() || !gltf.contains(version) || !gltf[version].is_string())
    refuse("not glTF: asset.version is missing");
  if (gltf[version].get<std::string>().rfind("2.", 0) != 0)
    refuse("glTF version " + gltf[version].get<std::string>() + ", not 2");
  for (const char* key : {"nodes", "scenes", "meshes", "materials", "accessors", "buffers", "bufferViews"})
    if (gltf.contains(key) && !gltf[key].is_array()) refuse(std::string(key) + " is not an array");
  if (gltf.contains("accessors"))
    for (const auto& accessor : gltf["accessors"])
      if (accessor.is_object() && accessor.contains("count") &&
          (!accessor["count"].is_number_unsigned() || accessor["count"].get<uint64_t>() > 3 * kMostTriangles))
        refuse("accessor of " + accessor["count"].dump() + " elements");
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
