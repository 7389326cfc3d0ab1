#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "io/scene_file.h"

namespace vdb_diffuse {

/// What the help says of flags of the medium that are not given.
enum class MediumDefaults { kUsual, kAsBaked };

/// The flags that say what the medium is made of and what lights it, shared by bake, reference, report and
/// render. Flags override the scene file: --sun replaces the file's suns, --env its domes, --occluder its
/// surfaces; other lights stay. Values are kept as written and checked by resolve(), so that every fault is
/// one line.
struct SceneOptions {
  std::optional<std::string> scene, sun, sun_irradiance, env, env_scale, occluder_albedo;
  std::vector<std::string> occluders;
  std::string up = "z";
  std::optional<std::string> density, sigma_s, sigma_a, sigma_t, albedo, albedo_grid, g, emission,
      emission_scale, temperature, temperature_scale, blackbody_intensity, min_density, crop;

  /// The object must outlive the parsing, in its place.
  void addTo(CLI::App& app);
  /// Only the flags of the medium.
  void addMediumTo(CLI::App& app, MediumDefaults defaults = MediumDefaults::kUsual);

  /// The names of files among them.
  std::vector<std::string*> paths();

  /// Reads the scene file, meshes and images, and lays the flags over them.
  /// \throws UsageError naming flag and value; InputError from the files
  SceneFile resolve() const;
};

}  // namespace vdb_diffuse
