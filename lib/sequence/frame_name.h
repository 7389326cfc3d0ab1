#pragma once

#include <string>

namespace vdb_diffuse {

/// A file name that stands for one file per frame. Where the frame's number goes is written in the manner of
///
///     cloud.####.vdb    as many digits at least as there are #: cloud.0007.vdb
///     cloud.%04d.vdb    likewise, as printf; %d: no more digits than it needs
///     cloud.$F4.vdb     likewise, as Houdini; $F: no more digits than it needs
///
/// anywhere in the path, folders included, and more than once if need be.

bool hasFrame(const std::string& name);

/// The name of one frame's file; a name that stands for a single file is returned as it is.
std::string frameName(const std::string& name, int frame);

}  // namespace vdb_diffuse
