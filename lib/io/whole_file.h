#pragma once

#include <string>
#include <utility>
#include <vector>

namespace vdb_diffuse {

/// Writes `bytes` beside `path` and moves the file into place once all of it has reached the disk.
/// \throws OutputError; a file that was at `path` is then as it was
void writeWholeFile(const std::string& path, const std::string& bytes);

/// Several files (path, bytes) that belong together: none takes its place before all are on the disk.
void writeWholeFiles(const std::vector<std::pair<std::string, std::string>>& files);

}  // namespace vdb_diffuse
