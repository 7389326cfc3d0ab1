#pragma once

#include <memory>
#include <string>
#include <vector>

#include "io/atomic_file.h"

namespace vdb_diffuse {

/// The folder to write into: made if it is missing, and removed again if nothing came to lie in it.
class OutputFolder {
 public:
  /// \param files  that will lie there: tried, so that a folder one may not write to is found before the work
  /// \throws OutputError
  OutputFolder(const std::string& path, const std::vector<std::string>& files);

  std::string file(const std::string& name) const;

 private:
  std::string path_;
  std::unique_ptr<RemovesEmptyFolder> made_;
};

}  // namespace vdb_diffuse
