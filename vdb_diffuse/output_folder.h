#pragma once

#include <string>
#include <vector>

namespace vdb_diffuse {

/// The folder to write into: made if it is missing, and removed again if nothing came to lie in it.
class OutputFolder {
 public:
  /// \param files  that will lie there: tried, so that a folder one may not write to is found before the work
  /// \throws OutputError
  OutputFolder(const std::string& path, const std::vector<std::string>& files);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  std::string file(const std::string& name) const;

 private:
  std::string path_;
  bool made_ = false;
};

}  // namespace vdb_diffuse
