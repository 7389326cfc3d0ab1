#pragma once

#include <functional>
#include <string_view>

namespace vdb_diffuse {

/// Called now and then by long work with the name of its phase and the fraction of that phase done, 0 to 1;
/// possibly from a worker thread, so it must be safe to call from any. It cancels the work by throwing
/// `Interrupted`. An empty function is allowed everywhere.
using Progress = std::function<void(std::string_view phase, double fraction)>;

}  // namespace vdb_diffuse
