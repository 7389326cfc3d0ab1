#pragma once

#include <vector>

#include "io/scene_file.h"
#include "io/vdb_reader.h"

namespace vdb_diffuse {

/// The medium that one or more files hold together: densities add on the voxels of the first file, what
/// `words` leaves out is cut away, and the voxels scatter and glow with what each file says of them. The
/// grids that were read are forgotten, as the work to come will want the memory. \param warnings  added to,
/// where values had to be changed or were missing \throws InputError naming file and grid
Medium readMedium(const std::vector<const VdbFile*>& files, const MediumSettings& words,
                  const ReadSettings& reading, std::vector<std::string>& warnings);

}  // namespace vdb_diffuse
