#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "grid/progress.h"
#include "log.h"

namespace vdb_diffuse {

enum class ProgressMode { kBar, kJson, kNone };

/// What --progress, --quiet and --log set. The mode is a bar unless chosen otherwise.
struct ProgressFlags {
  std::string mode = "bar", log = "warning";
  bool quiet = false;

  Log logOf(const std::string& command) const;
};
void addProgressFlags(CLI::App* command, ProgressFlags& flags);

/// Reports on standard error: a bar (nothing where that is no terminal), or one line of JSON per step,
/// {"phase":"solve","fraction":0.25}, after `json_fields`, which are members with a comma behind each. A
/// phase that another one follows has reached 1. Cancels the work after an interrupt, in every mode. Safe to
/// call from any thread; the bar is wiped when the last copy goes.
Progress makeProgress(ProgressMode mode, const std::string& json_fields = "");
Progress makeProgress(const ProgressFlags& flags, const std::string& json_fields = "");

}  // namespace vdb_diffuse
