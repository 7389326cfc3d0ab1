#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "grid/error.h"
#include "io/temporary_folder.h"

namespace vdb_diffuse {

/// Ends a fuzzer's run where what was read is not what its reader promises.
inline void expect(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

/// One try of a fuzzer: the bytes as a file that is called `name`, in a folder of the process's own, for
/// read(path). A refusal must be an InputError of one line that begins with the file's path.
template <typename Read>
int readFuzzed(const TemporaryFolder& folder, const char* name, const uint8_t* data, size_t size,
               const Read& read) {
  const std::string path = folder.file(name);
  writeText(path, std::string(reinterpret_cast<const char*>(data), size));
  try {
    read(path);
  } catch (const InputError& error) {
    const std::string line = error.what();
    expect(line.rfind(path, 0) == 0, "a refusal names the file");
    expect(line.find('\n') == std::string::npos, "a refusal is one line");
  }
  return 0;
}

}  // namespace vdb_diffuse
