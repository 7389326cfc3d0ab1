#include "io/whole_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "grid/error.h"
#include "io/atomic_file.h"

namespace vdb_diffuse {
namespace {

/// Fills the temporary file that stands for `path`.
void fill(const std::string& path, const std::string& temporary, const std::string& bytes) {
  const auto fail = [&] {
    throw OutputError(path + ": not written: " + std::strerror(errno) +
                      "; check the folder and the free space");
  };
  std::FILE* stream = std::fopen(temporary.c_str(), "wb");
  if (!stream) fail();
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), stream) == bytes.size();
  const int error = errno;
  const bool closed = std::fclose(stream) == 0;  // the last bytes may meet a full disk only here
  if (!written) errno = error;
  if (!written || !closed) fail();
}

}  // namespace

void writeWholeFiles(const std::vector<std::pair<std::string, std::string>>& files) {
  std::vector<std::unique_ptr<AtomicFile>> places;
  for (const auto& [path, bytes] : files) {
    places.push_back(std::make_unique<AtomicFile>(path));
    fill(path, places.back()->temporary(), bytes);
  }
  for (const auto& place : places) place->commit();
}

void writeWholeFile(const std::string& path, const std::string& bytes) {
  writeWholeFiles({{path, bytes}});
}

}  // namespace vdb_diffuse
