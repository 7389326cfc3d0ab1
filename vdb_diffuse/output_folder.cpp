#include "output_folder.h"

#include <filesystem>

#include "grid/error.h"

namespace vdb_diffuse {

OutputFolder::OutputFolder(const std::string& path, const std::vector<std::string>& files) : path_(path) {
  std::error_code error;
  const bool made = std::filesystem::create_directory(path, error);
  if (error) throw OutputError(path + ": the folder cannot be made: " + error.message());
  if (made) made_ = std::make_unique<RemovesEmptyFolder>(path);
  for (const std::string& name : files) AtomicFile probe(file(name));
}

std::string OutputFolder::file(const std::string& name) const {
  return (std::filesystem::path(path_) / name).string();
}

}  // namespace vdb_diffuse
