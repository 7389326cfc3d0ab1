#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "grid/progress.h"

namespace vdb_diffuse {

enum class ProgressMode { kBar, kJson, kNone };

/// What --progress and --quiet set. The mode is a bar unless chosen otherwise.
struct ProgressFlags {
  std::string mode = "bar";
  bool quiet = false;
};
void addProgressFlags(CLI::App* command, ProgressFlags& flags);

/// Reports on standard error: a bar (nothing where that is no terminal), or one line of JSON per step,
/// {"phase":"solve","fraction":0.25}. Cancels the work after an interrupt, in every mode. Safe to call from
/// any thread; the bar is wiped when the last copy goes.
Progress makeProgress(ProgressMode mode);
Progress makeProgress(const ProgressFlags& flags);

}  // namespace vdb_diffuse
