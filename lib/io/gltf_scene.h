#pragma once

#include <string>

#include "io/mesh_file.h"

namespace vdb_diffuse {

/// A .gltf or .glb file as a whole scene.
///
/// Meshes are surfaces with the material's base colour as albedo; textures are not read. A mesh with an
/// emissive material is an area light and no surface: radiance = emissiveFactor times the strength of
/// KHR_materials_emissive_strength, taken as W/m2/sr, as Blender writes it. KHR_lights_punctual: directional
/// lights are suns of irradiance = lux / 683 lm/W; point and spot lights have intensity = candela / 683, and
/// a spot fades between its two cones by Cycles' smoothstep. A light shines along the node's -z. glTF's y up
/// is turned to the VDB's axes. \throws InputError naming the path
Scene readGltfScene(const std::string& path, Up up = Up::kZ);

}  // namespace vdb_diffuse
