#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>

namespace vdb_diffuse {

constexpr size_t kLargestMeshFile = size_t(1) << 30;  ///< bytes, one file and what it refers to
constexpr size_t kMostGltfNodes = 1'000'000;
constexpr int kDeepestGltfNode = 256;  ///< levels; readers recurse

/// The JSON of a .gltf or .glb file, its node tree, counts and sizes checked: every node has one parent at
/// most, so that a walk from the roots ends and visits each node once; accessors end within their buffer
/// views, and these within their buffers. \throws InputError naming the path
nlohmann::json readGltfJson(const std::string& path);

}  // namespace vdb_diffuse
