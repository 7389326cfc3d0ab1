#pragma once

#include <cstdint>

namespace vdb_diffuse {

/// Bytes that this process can still take without swapping: the least of what the system says is available,
/// the control group's limit and the process's address-space limit. Where none of them can be read, 2^62.
uint64_t freeMemory();

}  // namespace vdb_diffuse
