#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace vdb_diffuse {

class ByteReader;

/// The frame of a VDB file, read from its bytes without OpenVDB: what grids it says it has and where each
/// lies. OpenVDB reads past the end of a truncated file without a word, and reports a write to a full disk as
/// done; the frame shows both. Every count and offset is held against the file's size before it is used.
struct VdbHeader {
  struct Grid {
    std::string name;  ///< as OpenVDB lists it: "name", or "name[n]" where several have the same
    std::string type;  ///< for instance Tree_float_5_4_3, with _HalfFloat where values are stored in 16 bits
    std::string tree_type;                                             ///< without _HalfFloat
    std::string instance_of;                                           ///< the grid whose tree it shares
    bool half = false;                                                 ///< values are stored in 16 bits
    uint64_t grid_position = 0, block_position = 0, end_position = 0;  ///< in the file, bytes
    uint32_t compression = 0;                                          ///< openvdb::io::COMPRESS_... flags

    bool checked = false;     ///< by checkVdb: all of its tree, so that OpenVDB may read it
    uint64_t tree_bytes = 0;  ///< by checkVdb: what the tree will take in memory
  };
  uint64_t bytes = 0;  ///< the file's size
  uint32_t file_version = 0;
  bool has_offsets = false;  ///< without (written as a stream) grids are not listed here
  std::vector<Grid> grids;

  bool has(const std::string& name) const;
};

/// Throws InputError, beginning with the path: no such file, not a regular file, not a VDB, truncated.
VdbHeader readVdbHeader(const std::string& path);

/// The same from a file's first byte on, with something to be done at each grid: `visit` finds the reader at
/// the grid's compression flags. Where the file has no offsets, it leaves the reader at the grid's end, and
/// the grids are listed.
using VisitGrid = std::function<void(const VdbHeader& so_far, VdbHeader::Grid& grid)>;
VdbHeader readVdbHeader(ByteReader& in, const VisitGrid& visit = {});

/// "blosc, active values", "none".
std::string compressionName(uint32_t flags);

}  // namespace vdb_diffuse
