#pragma once

#include <optional>
#include <string>
#include <vector>

#include "grid/volume_cut.h"
#include "io/mesh_file.h"
#include "medium/medium.h"
#include "scene/scene.h"

namespace vdb_diffuse {

/// What a scene file or the command line says about the medium; what is absent keeps its default.
struct MediumSettings {
  std::optional<std::string> density, emission, temperature, albedo_grid;  ///< names of grids
  std::optional<Vec3d> sigma_s, sigma_a;      ///< per unit density, 1/(length density), >= 0
  std::optional<double> g;                    ///< mean scattering cosine, -1 < g < 1
  std::optional<double> emission_scale;       ///< factor on the emission grid's radiance, >= 0
  std::optional<double> temperature_scale;    ///< kelvin per unit of the temperature grid, >= 0
  std::optional<double> blackbody_intensity;  ///< factor on the radiance of a black body, >= 0
  std::optional<double> min_density;          ///< voxels of less are left out, >= 0
  std::optional<WorldBox> crop;               ///< voxels whose centre lies outside are left out
};

/// The voxels that are left out.
VolumeCut cutOf(const MediumSettings& settings);

/// sigma_s 1, sigma_a 0, g 0 and emission_scale 1 where nothing is said.
Optics opticsOf(const MediumSettings& settings);

struct SceneFile {
  MediumSettings medium;
  Scene scene;
  std::vector<std::string> files;  ///< paths of what was read: the file itself, its meshes and images
};

/// Everything at once: a .json scene (medium, lights, surfaces) or a .gltf/.glb file (lights and surfaces).
/// In JSON, angles are degrees, paths are relative to the file, and RGB is a number or three; an unknown key
/// is an error. A sun and a spot need a direction, a point and a spot a position, an area light and a surface
/// a mesh; `group` sets a light apart; radiance, intensity and irradiance are 1 and a surface is black where
/// nothing is said. `sigma_t` with `albedo` may stand for `sigma_s` and `sigma_a`. \param up   the VDB's axis
/// that points up: glTF files, also those a JSON scene names, are turned to it \throws InputError with the
/// path and the place in the file: "scene.json: lights[2].angle: ..."
SceneFile readSceneFile(const std::string& path, Up up = Up::kZ);

}  // namespace vdb_diffuse
