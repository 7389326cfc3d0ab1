#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace vdb_diffuse {

struct RunLimits {
  unsigned seconds = 10;  ///< of the processor's time; six times as long by the clock, as others may work too
  uint64_t bytes = uint64_t(2) << 30;  ///< of address space; not held where a sanitizer needs more
};

/// What became of a program.
struct LimitedRun {
  int status = 0;  ///< as waitpid tells
  bool hung = false;
  long peak_kilobytes = 0;  ///< resident
  std::string out, error;
};

/// Runs a program, by its path and arguments, under limits of time and memory, without a core dump.
/// \param folder   where its standard output and error are kept
LimitedRun runLimited(const std::vector<std::string>& words, const std::string& folder,
                      const RunLimits& limits = {});

/// In words: "accepted", "accepted, not converged" and "refused" are as they should be; all others are
/// faults. A refusal is status 3 with one line on standard error that holds `named`, and no file `output`.
std::string verdictOf(const LimitedRun& run, const std::string& named, const std::string& output);

}  // namespace vdb_diffuse
