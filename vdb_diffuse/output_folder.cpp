#include "output_folder.h"

#include <filesystem>

#include "grid/error.h"
#include "io/atomic_file.h"

namespace vdb_diffuse {

OutputFolder::OutputFolder(const std::string& path, const std::vector<std::string>& files) : path_(path) {
  std::error_code error;
  made_ = std::filesystem::create_directory(path, error);
  if (error) throw OutputError(path + ": the folder cannot be made: " + error.message());
  for (const std::string& name : files) AtomicFile probe(file(name));
}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  if (made_ && std::filesystem::is_empty(path_, ignored)) std::filesystem::remove(path_, ignored);
}

std::string OutputFolder::file(const std::string& name) const {
  return (std::filesystem::path(path_) / name).string();
}

}  // namespace vdb_diffuse
