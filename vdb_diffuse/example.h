#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace vdb_diffuse {

/// Every subcommand's help ends with an example one can paste: `lines` are commands, one per line.
inline void setExample(CLI::App* command, const std::string& lines) {
  std::string footer = "Example:\n";
  for (size_t from = 0; from < lines.size();) {
    const size_t end = std::min(lines.find('\n', from), lines.size());
    footer += "  " + lines.substr(from, end - from) + "\n";
    from = end + 1;
  }
  command->footer(footer);
}

}  // namespace vdb_diffuse
