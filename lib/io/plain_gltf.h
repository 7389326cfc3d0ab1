#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace vdb_diffuse {

/// The file at `path` again with nothing in it but what is of use here: nodes and their places, triangles by
/// position and index, the factors of materials. An importer takes in everything that a glTF file holds and
/// trusts most of it: pictures, skins, animations, compressed meshes, lines. What it is not given cannot do
/// harm.
///
/// \param gltf  its JSON as readGltfJson has checked it
/// \return the bytes of a .gltf, or of a .glb where `path` is one; external buffers stay where they are
/// \throws InputError naming the path
std::string plainGltf(const nlohmann::json& gltf, const std::string& path);

}  // namespace vdb_diffuse
