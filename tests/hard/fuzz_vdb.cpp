// A libFuzzer target: whatever the check of a VDB file's bytes accepts, OpenVDB must be able to read.
//
//   CC=clang CXX=clang++ cmake -S . -B build_fuzz -G Ninja -DVDB_DIFFUSE_FUZZ=ON
//   ninja -C build_fuzz fuzz_vdb
//   ASAN_OPTIONS=detect_leaks=0 build_fuzz/tests/hard/fuzz_vdb -rss_limit_mb=2048 FOLDER_OF_VDB_FILES
//
// Leaks are not looked for: OpenVDB drops the nodes it has made where a value does not unpack.
#include <openvdb/openvdb.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>

#include "grid/error.h"
#include "vdb/structure.h"

namespace {

constexpr uint64_t kLargestTree = 256 << 20;  // bytes; the program asks for the memory that is free

bool fits(const vdb_diffuse::VdbHeader& header) {
  uint64_t bytes = 0;
  for (const auto& grid : header.grids) bytes += grid.tree_bytes;
  return bytes <= kLargestTree;
}

void readAll(const std::string& path, const vdb_diffuse::VdbHeader& header) {
  openvdb::io::File file(path);
  file.open(false);
  for (auto name = file.beginName(); name != file.endName(); ++name) {
    const auto type = file.readGridMetadata(name.gridName())->type();
    const bool checked = std::none_of(header.grids.begin(), header.grids.end(), [&](const auto& grid) {
      return grid.tree_type == type && !grid.checked;
    });
    if (checked) file.readGrid(name.gridName())->activeVoxelCount();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  openvdb::initialize();
  const int memory = ::memfd_create("in.vdb", MFD_CLOEXEC);
  const std::string path = "/proc/self/fd/" + std::to_string(memory);
  try {
    if (memory < 0 || ::write(memory, data, size) != static_cast<ssize_t>(size)) std::abort();
    const vdb_diffuse::VdbHeader header = vdb_diffuse::checkVdb(path);
    if (fits(header)) readAll(path, header);
  } catch (const vdb_diffuse::InputError&) {
  } catch (const openvdb::Exception&) {
  }
  ::close(memory);
  return 0;
}
