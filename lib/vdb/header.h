#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace vdb_diffuse {

/// The frame of a VDB file, read from its bytes without OpenVDB: what grids it says it has and where each
/// lies. OpenVDB reads past the end of a truncated file without a word, and reports a write to a full disk as
/// done; the frame shows both. Every count and offset is held against the file's size before it is used.
struct VdbHeader {
  struct Grid {
    std::string name;  ///< as OpenVDB lists it: "name", or "name[n]" where several have the same
    std::string type;  ///< for instance Tree_float_5_4_3, with _HalfFloat where values are stored in 16 bits
    uint64_t grid_position = 0, block_position = 0, end_position = 0;  ///< in the file, bytes
    uint32_t compression = 0;                                          ///< openvdb::io::COMPRESS_... flags
  };
  uint64_t bytes = 0;  ///< the file's size
  uint32_t file_version = 0;
  bool has_offsets = false;  ///< without (written as a stream) grids are not listed here
  std::vector<Grid> grids;

  bool has(const std::string& name) const;
};

/// Throws InputError, beginning with the path: no such file, not a regular file, not a VDB, truncated.
VdbHeader readVdbHeader(const std::string& path);

/// "blosc, active values", "none".
std::string compressionName(uint32_t flags);

}  // namespace vdb_diffuse
