#pragma once

#include <optional>
#include <string>
#include <vector>

#include "render/emission.h"

namespace vdb_diffuse {

/// What a user may say about a lit volume; what is left out is taken from the lighting grids' metadata, where
/// `bake` stores it, and else has the defaults of a medium.
struct LitVolumeSettings {
  std::string density, emission;  ///< names of grids; empty: not said
  std::optional<Vec3d> sigma_s, sigma_a;
  std::optional<double> g, emission_scale;
  bool diffuse = true, direct = true;  ///< which of the two to load
};

/// Reads density, light and medium from the output of `bake`. What is missing but can be done without is
/// added to `warnings`, one line each. \throws InputError naming the file, the grid and, where one is
/// missing, those there are
LitVolume readLitVolume(const std::string& path, const LitVolumeSettings& settings,
                        std::vector<std::string>& warnings);

}  // namespace vdb_diffuse
