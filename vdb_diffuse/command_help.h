#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace vdb_diffuse {

/// What the program's help says, as data: from one walk over the CLI11 description that also parses the
/// command line, so that completion and manual cannot differ from it.

struct OptionHelp {
  std::vector<std::string> names;  ///< "-o", "--output"; of an argument its name alone
  std::string value;               ///< "FILE", or "{bar,json}"; empty: the option takes none
  std::string what, group, fallback;
  std::vector<std::string> choices;  ///< all values that are taken; empty: any
  bool required = false, argument = false;
};

struct CommandHelp {
  std::string name, what, footer;
  std::vector<OptionHelp> options;  ///< in the order of the help, those of a group together
  std::vector<CommandHelp> commands;
};

/// \param app   not const, as CLI11 lists commands only so
CommandHelp helpOf(CLI::App& app);

/// Scripts that complete commands, options and the values of those that take one of a few; else files.
std::string bashCompletion(const CommandHelp& program);
std::string zshCompletion(const CommandHelp& program);

/// The manual's page in troff's man macros. \param version   for its foot
std::string manualPage(const CommandHelp& program, const std::string& version);

}  // namespace vdb_diffuse
