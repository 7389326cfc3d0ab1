#pragma once

#include <string>

#include "vdb/header.h"

namespace vdb_diffuse {

/// Walks the whole of a VDB file as OpenVDB would, and refuses what OpenVDB would trip over: it may crash,
/// run on or take all memory where a count, a length or a mask is damaged, and accepts a truncated file
/// without a word. What the header lists is then filled in for each grid, in files written as a stream as
/// well. Values are not looked at, nor is anything unpacked but zip.
///
/// Throws InputError that names the file, the grid and the place.
VdbHeader checkVdb(const std::string& path);

}  // namespace vdb_diffuse
