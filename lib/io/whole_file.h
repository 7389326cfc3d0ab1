#pragma once

#include <string>

namespace vdb_diffuse {

/// Writes `bytes` beside `path` and moves the file into place once all of it has reached the disk.
/// \throws OutputError; a file that was at `path` is then as it was
void writeWholeFile(const std::string& path, const std::string& bytes);

}  // namespace vdb_diffuse
