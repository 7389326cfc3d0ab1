#include "command_help.h"

#include <algorithm>

namespace vdb_diffuse {
namespace {

/// The values in the braces that CLI::IsMember puts into a type: "TEXT:{bar,json,none}".
std::vector<std::string> choicesIn(const std::string& type) {
  std::vector<std::string> choices;
  const size_t open = type.find('{'), close = type.find('}');
  if (open == std::string::npos || close == std::string::npos || close < open) return choices;
  for (size_t from = open + 1; from < close;) {
    const size_t end = std::min(type.find(',', from), close);
    choices.push_back(type.substr(from, end - from));
    from = end + 1;
  }
  return choices;
}

OptionHelp optionOf(const CLI::Option& option) {
  OptionHelp help;
  help.argument = option.get_positional();
  if (help.argument) {
    help.names = {option.get_name(true)};
  } else {
    for (const std::string& name : option.get_snames()) help.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) help.names.push_back("--" + name);
  }
  help.what = option.get_description();
  help.group = option.get_group();
  help.required = option.get_required();
  if (option.get_type_size() == 0) return help;  // a flag
  const std::string type = option.get_type_name();
  help.choices = choicesIn(type);
  const size_t colon = type.find(':');
  help.value = type.compare(0, 6, "TEXT:{") == 0 ? type.substr(5) : type.substr(0, colon);
  help.fallback = option.get_default_str();
  return help;
}

}  // namespace

CommandHelp helpOf(CLI::App& app) {
  CommandHelp help{app.get_name(), app.get_description(), app.get_footer(), {}, {}};
  std::vector<std::string> groups;
  for (const CLI::Option* option : app.get_options()) {
    const std::string& group = option->get_group();
    if (!group.empty() && std::find(groups.begin(), groups.end(), group) == groups.end())
      groups.push_back(group);  // one without a group is hidden
  }
  for (const std::string& group : groups)
    for (const CLI::Option* option : app.get_options())
      if (option->get_group() == group) help.options.push_back(optionOf(*option));
  for (CLI::App* command : app.get_subcommands([](CLI::App*) { return true; }))
    help.commands.push_back(helpOf(*command));
  return help;
}

}  // namespace vdb_diffuse
