#include "vdb/header.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

constexpr uint64_t kMagic = 0x56444220;           // "VDB "
constexpr uint32_t kOldest = 213, kNewest = 999;  // 213: values of nodes are compressed
constexpr uint32_t kUuidInAscii = 218, kInstances = 216, kSelectiveCompression = 220, kGridCompression = 222;
constexpr uint64_t kLongestName = 1 << 16;

/// Little-endian values, with the file's size known; a step past its end is an error.
class ByteReader {
 public:
  ByteReader(const std::string& path, uint64_t size) : path_(path), size_(size), in_(path, std::ios::binary) {
    if (!in_) throw InputError(path + ": cannot be opened: " + std::strerror(errno));
  }
  template <typename T>
  T read() {
    T value{};
    take(reinterpret_cast<char*>(&value), sizeof value);
    return value;
  }
  std::string readString() {
    const uint32_t length = read<uint32_t>();
    if (length > kLongestName)
      throw InputError(path_ + ": damaged: a name of " + std::to_string(length) + " bytes");
    std::string text(length, '\0');
    take(text.data(), length);
    return text;
  }
  void skip(uint64_t bytes) { seek(position_ + bytes); }
  void seek(uint64_t position) {
    if (position > size_) truncated(position);
    position_ = position;
    in_.seekg(static_cast<std::streamoff>(position));
  }
  uint64_t position() const { return position_; }

 private:
  std::string path_;
  uint64_t size_, position_ = 0;
  std::ifstream in_;

  void take(char* to, uint64_t bytes) {
    if (bytes > size_ - position_) truncated(position_ + bytes);
    in_.read(to, static_cast<std::streamsize>(bytes));
    if (!in_) throw InputError(path_ + ": cannot be read: " + std::strerror(errno));
    position_ += bytes;
  }
  [[noreturn]] void truncated(uint64_t expected) const {
    throw InputError(path_ + ": truncated or damaged: it has " + std::to_string(size_) +
                     " bytes and speaks of byte " + std::to_string(expected) + "; copy or write it again");
  }
};

uint64_t sizeOfRegularFile(const std::string& path) {
  struct stat status;
  if (::stat(path.c_str(), &status) != 0) throw InputError(path + ": " + std::strerror(errno));
  if (S_ISDIR(status.st_mode)) throw InputError(path + ": is a directory, not a VDB file");
  if (!S_ISREG(status.st_mode))
    throw InputError(path + ": is not a regular file (VDB needs one that can be searched)");
  return static_cast<uint64_t>(status.st_size);
}

/// OpenVDB keeps names apart by a record separator and a number, and shows "name[number]".
std::string shownName(const std::string& unique) {
  const size_t separator = unique.find('\x1e');
  if (separator == std::string::npos) return unique;
  return unique.substr(0, separator) + "[" + unique.substr(separator + 1) + "]";
}

}  // namespace

bool VdbHeader::has(const std::string& name) const {
  return std::any_of(grids.begin(), grids.end(), [&](const Grid& grid) { return grid.name == name; });
}

VdbHeader readVdbHeader(const std::string& path) {
  VdbHeader header;
  header.bytes = sizeOfRegularFile(path);
  ByteReader in(path, header.bytes);
  if (header.bytes < 8 || in.read<uint64_t>() != kMagic) throw InputError(path + ": is not a VDB file");
  header.file_version = in.read<uint32_t>();
  if (header.file_version < kOldest || header.file_version > kNewest)
    throw InputError(path + ": VDB file version " + std::to_string(header.file_version) +
                     " is not supported");
  in.skip(8);  // version of the library that wrote it
  header.has_offsets = in.read<char>() != 0;
  if (header.file_version >= kSelectiveCompression && header.file_version < kGridCompression) in.skip(1);
  in.skip(header.file_version >= kUuidInAscii ? 36 : 16);

  const uint32_t metadata_count = in.read<uint32_t>();
  for (uint32_t m = 0; m < metadata_count;
       ++m) {  // each takes at least 12 bytes, so damage ends at the file's end
    in.readString();
    in.readString();
    in.skip(in.read<uint32_t>());
  }
  if (!header.has_offsets) return header;
  const int32_t grid_count = in.read<int32_t>();
  if (grid_count < 0) throw InputError(path + ": damaged: " + std::to_string(grid_count) + " grids");
  for (int32_t g = 0; g < grid_count; ++g) {
    VdbHeader::Grid grid;
    grid.name = shownName(in.readString());
    grid.type = in.readString();
    if (header.file_version >= kInstances) in.readString();
    grid.grid_position = in.read<uint64_t>();
    grid.block_position = in.read<uint64_t>();
    grid.end_position = in.read<uint64_t>();
    if (grid.grid_position < in.position() || grid.block_position < grid.grid_position ||
        grid.end_position < grid.block_position)
      throw InputError(path + ": grid " + grid.name + ": damaged: its parts overlap");
    if (grid.end_position > header.bytes) in.seek(grid.end_position);  // says how much is missing
    if (header.file_version >= kGridCompression) {
      in.seek(grid.grid_position);
      grid.compression = in.read<uint32_t>();
    }
    in.seek(grid.end_position);
    header.grids.push_back(std::move(grid));
  }
  return header;
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
