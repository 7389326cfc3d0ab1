#include "io/whole_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "grid/error.h"
#include "io/atomic_file.h"

namespace vdb_diffuse {

void writeWholeFile(const std::string& path, const std::string& bytes) {
  AtomicFile file(path);
  const auto fail = [&] {
    throw OutputError(path + ": not written: " + std::strerror(errno) +
                      "; check the folder and the free space");
  };
  std::FILE* stream = std::fopen(file.temporary().c_str(), "wb");
  if (!stream) fail();
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), stream) == bytes.size();
  const int error = errno;
  const bool closed = std::fclose(stream) == 0;  // the last bytes may meet a full disk only here
  if (!written) errno = error;
  if (!written || !closed) fail();
  file.commit();
}

}  // namespace vdb_diffuse
