#include "vdb/header.h"

#include <algorithm>

#include "vdb/byte_reader.h"
#include "vdb/metadata_check.h"

namespace vdb_diffuse {
namespace {

constexpr uint64_t kMagic = 0x56444220;  // "VDB "
constexpr uint32_t kOldest = 222,
                   kNewest = 225;  // 222: compression by grid, and values without inactive ones

/// OpenVDB keeps names apart by a record separator and a number, and shows "name[number]".
std::string shownName(const std::string& unique) {
  const size_t separator = unique.find('\x1e');
  if (separator == std::string::npos) return unique;
  return unique.substr(0, separator) + "[" + unique.substr(separator + 1) + "]";
}

/// A random number that tells files apart. OpenVDB reads it as formatted text, and where it is none reads
/// nothing after it and lists no grids.
void passUuid(ByteReader& in) {
  constexpr int kLength = 36;
  const char* text = in.take(kLength);
  for (int n = 0; n < kLength; ++n) {
    const bool hyphen = n == 8 || n == 13 || n == 18 || n == 23;
    const bool digit = (text[n] >= '0' && text[n] <= '9') || (text[n] >= 'a' && text[n] <= 'f') ||
                       (text[n] >= 'A' && text[n] <= 'F');
    if (hyphen ? text[n] != '-' : !digit) in.failDamaged("its unique identifier is none");
  }
}

VdbHeader::Grid readDescriptor(ByteReader& in, bool has_offsets) {
  VdbHeader::Grid grid;
  in.setSubject("");
  grid.name = shownName(in.readText());
  in.setSubject("grid " + grid.name);
  grid.type = in.readText();
  const std::string suffix = "_HalfFloat";
  grid.half = grid.type.size() > suffix.size() &&
              grid.type.compare(grid.type.size() - suffix.size(), suffix.size(), suffix) == 0;
  grid.tree_type = grid.half ? grid.type.substr(0, grid.type.size() - suffix.size()) : grid.type;
  grid.instance_of = shownName(in.readText());
  grid.grid_position = in.read<uint64_t>();
  grid.block_position = in.read<uint64_t>();
  grid.end_position = in.read<uint64_t>();
  if (!has_offsets) return grid;
  const bool has_blocks = grid.instance_of.empty();
  if (grid.grid_position < in.position() || grid.end_position < grid.grid_position ||
      (has_blocks && (grid.block_position < grid.grid_position || grid.end_position < grid.block_position)))
    in.failDamaged("its parts overlap");
  if (grid.end_position > in.size()) in.seek(grid.end_position);  // says how much is missing
  return grid;
}

}  // namespace

bool VdbHeader::has(const std::string& name) const {
  return std::any_of(grids.begin(), grids.end(), [&](const Grid& grid) { return grid.name == name; });
}

VdbHeader readVdbHeader(ByteReader& in, const VisitGrid& visit) {
  VdbHeader header;
  header.bytes = in.size();
  if (header.bytes < 8 || in.read<uint64_t>() != kMagic) in.fail("is not a VDB file");
  header.file_version = in.read<uint32_t>();
  if (header.file_version < kOldest || header.file_version > kNewest)
    in.fail("is of VDB file version " + std::to_string(header.file_version) + "; " + std::to_string(kOldest) +
            " to " + std::to_string(kNewest) + " are read; write it again by another version of OpenVDB");
  in.skip(8);  // version of the library that wrote it
  header.has_offsets = in.readBool();
  passUuid(in);
  checkMetadata(in);
  if (!header.has_offsets && !visit) return header;
  const int32_t grid_count = in.read<int32_t>();
  if (grid_count < 0) in.failDamaged(std::to_string(grid_count) + " grids");
  for (int32_t g = 0; g < grid_count; ++g) {
    VdbHeader::Grid grid = readDescriptor(in, header.has_offsets);
    if (header.has_offsets) in.seek(grid.grid_position);
    if (visit) {
      visit(header, grid);
    } else {
      grid.compression = in.read<uint32_t>();
    }
    if (header.has_offsets) in.seek(grid.end_position);
    header.grids.push_back(std::move(grid));
  }
  in.setSubject("");
  return header;
}

VdbHeader readVdbHeader(const std::string& path) {
  ByteReader in(path);
  return readVdbHeader(in);
}

std::string compressionName(uint32_t flags) {
  std::string name;
  const auto add = [&](const char* word) { name += (name.empty() ? "" : ", ") + std::string(word); };
  if (flags & 1) add("zip");
  if (flags & 4) add("blosc");
  if (flags & 2) add("active values");
  return name.empty() ? "none" : name;
}

}  // namespace vdb_diffuse
