#pragma once

#include <string>
#include <vector>

#include "io/scene_file.h"
#include "io/vdb_reader.h"
#include "render/emission.h"

namespace vdb_diffuse {

/// What a user may say about a lit volume.
struct LitVolumeSettings {
  MediumSettings medium;  ///< what is absent is taken from the lighting grids' metadata, else by default
  ReadSettings read;
  bool diffuse = true, direct = true;  ///< which of the two to load, at least one
};

/// Reads density, light and medium from the output of `bake`. What is missing but can be done without is
/// added to `warnings`, one line each. \throws InputError naming the file, the grid and, where one is
/// missing, those there are
LitVolume readLitVolume(const std::string& path, const LitVolumeSettings& settings,
                        std::vector<std::string>& warnings);

}  // namespace vdb_diffuse
