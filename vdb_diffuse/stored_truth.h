#pragma once

#include <string>
#include <vector>

#include "report/measurement.h"

namespace vdb_diffuse {

/// A reference that exists already: the grids diffuse and diffuse_se of a file, as `vdb_diffuse reference`
/// writes them. What makes it doubtful is added to `warnings`, one line each.
/// \throws InputError where its voxels are not the medium's, or it was made with other optics
Truth readTruth(const std::string& path, const Medium& medium, std::vector<std::string>& warnings);

}  // namespace vdb_diffuse
