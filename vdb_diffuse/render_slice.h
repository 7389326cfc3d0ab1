#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "progress_bar.h"

namespace vdb_diffuse {

/// A slice of a grid instead of a view of the volume.
struct SliceFlags {
  std::optional<std::string> slice, grid, range;

  bool given() const { return slice.has_value(); }
  void addTo(CLI::App& command);
  /// \throws UsageError where flags of a slice stand without one
  void refuseAlone() const;
};

/// \throws UsageError, InputError, OutputError
void renderSlice(const SliceFlags& flags, const std::string& input, const std::string& output,
                 const ProgressFlags& progress);

}  // namespace vdb_diffuse
