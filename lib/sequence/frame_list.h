#pragma once

#include <string>
#include <vector>

namespace vdb_diffuse {

/// Numbers of frames as farms and artists write them, in the order written, each once:
///
///     1-100        from 1 to 100
///     1-100x2      every second of them: 1, 3, .. 99; 1-100:2 is the same
///     1-3,5,20-7   several, separated by commas; a range may count down
///
/// \throws UsageError naming the part that cannot be understood, or for more than a million frames
std::vector<int> framesIn(const std::string& text);

}  // namespace vdb_diffuse
