#pragma once

#include <map>
#include <string>
#include <variant>
#include <vector>

#include "io/vdb_reader.h"

namespace vdb_diffuse {

using Metadata = std::map<std::string, std::variant<std::string, double, int>>;

/// A grid to be written: one channel makes a float grid, three make vec3s (colours, or a vector's
/// components).
struct OutputGrid {
  std::string name;
  std::string unit;   ///< stored as metadata `unit`
  Channels channels;  ///< on the topology of the volume they are written with
  Metadata metadata;
  bool as_is = false;  ///< neither widened nor stored in 16 bits
};

struct WriteSettings {
  bool half = false;  ///< store the written grids in 16 bits; one that does not fit is stored in 32
  int dilate = 0;     ///< widen the written grids by so many voxels, 0..32, filled from their neighbours
  Metadata metadata;  ///< of the file
};

struct WriteReport {
  uint64_t bytes = 0;  ///< size of the file
  std::vector<std::string> warnings;
};

/// Writes grids on the voxels of `where`, and before them the grids of `source` that `keep` names ("all" for
/// each that is not replaced), unchanged: values, tiles, half flag and metadata. Atomic, and verified: a full
/// disk is an OutputError, and the file that was there is untouched then. Grids are taken by value: move
/// them in, and each is freed as soon as its tree stands.
///
/// Throws UsageError where the target is the source's own file, or two grids would have one name; InputError
/// where the source lacks a grid to keep; OutputError where the file cannot be written.
/// \param source   may be null; its grid `where.name`, if there is one, lends its transform to the new
///                 grids if they have its voxels
///                 where that is the same
WriteReport writeVdb(const std::string& path, const Volume& where, std::vector<OutputGrid> grids,
                     const WriteSettings& settings = {}, const VdbFile* source = nullptr,
                     const std::vector<std::string>& keep = {});

/// A volume alone, as a fog volume under its name, with metadata of the file.
void writeVolume(const std::string& path, const Volume& volume,
                 const std::map<std::string, std::string>& metadata = {});

}  // namespace vdb_diffuse
