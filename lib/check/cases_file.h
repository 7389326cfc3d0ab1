#pragma once

#include <optional>
#include <string>
#include <vector>

namespace vdb_diffuse {

/// One regression test: a bake, and how near its grids must come to those stored.
struct CheckCase {
  std::string name;                                     ///< letters, digits and . _ -, unique in its file
  std::string volume;                                   ///< path of the VDB file to bake
  std::string bake;                                     ///< words for its bake, as on the command line
  std::string stored;                                   ///< path of the VDB file to hold it against
  std::vector<std::string> grids{"diffuse", "direct"};  ///< that are held against it
  std::optional<double> max_rms, max_abs;               ///< limits as of `compare`: fractions, one at least
  int block = 1;  ///< cells of so many voxels a side are averaged, stored and compared
};

/// A list of regression tests:
///
///     { "defaults": { "max_rms": 0.01, "max_abs": 0.1, "block": 2 },
///       "cases": [ { "name": "cloud_noon", "volume": "cloud.vdb", "bake": "--sun 0,0,-1 --env 0.3" },
///                  { "name": "cloud_dusk", "volume": "cloud.vdb", "bake": "--scene dusk.json",
///                    "grids": ["diffuse"], "max_rms": 0.02, "stored": "accepted/dusk.vdb" } ] }
///
/// `defaults` may hold bake, grids, max_rms, max_abs and block. Paths are relative to the file; a volume may
/// begin with an environment variable, "$SHOW/cloud.vdb". Without `stored` it is NAME.vdb beside the file.
/// \throws InputError with the path and the place in the file; an unknown key is named
std::vector<CheckCase> readCases(const std::string& path);

}  // namespace vdb_diffuse
