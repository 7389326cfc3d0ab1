#include <functional>

#include "command_help.h"

namespace vdb_diffuse {
namespace {

std::string joined(const std::vector<std::string>& words, const std::string& between) {
  std::string line;
  for (const std::string& word : words) line += (line.empty() ? "" : between) + word;
  return line;
}

std::vector<std::string> flagsOf(const CommandHelp& command) {
  std::vector<std::string> names;
  for (const OptionHelp& option : command.options)
    if (!option.argument) names.insert(names.end(), option.names.begin(), option.names.end());
  return names;
}

std::vector<std::string> commandsOf(const CommandHelp& command) {
  std::vector<std::string> names;
  for (const CommandHelp& part : command.commands) names.push_back(part.name);
  return names;
}

using Visit = std::function<void(const std::string& path, const CommandHelp&)>;

/// Every command with the words that lead to it, "make cloud"; the program's own path is empty.
void visitAll(const CommandHelp& command, const std::string& path, const Visit& visit) {
  visit(path, command);
  for (const CommandHelp& part : command.commands)
    visitAll(part, path.empty() ? part.name : path + " " + part.name, visit);
}

/// In single quotes of a shell; what zsh's _arguments reads as its own is taken out of the way.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? "'\\''" : std::string(1, c);
  return out + "'";
}

std::string forArguments(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out;
}

/// '(-o --output)'{-o,--output}'[VDB file to write]:TEXT:_files'
std::string zshSpec(const OptionHelp& option) {
  const std::string value =
      option.value.empty()
          ? ""
          : ":" + forArguments(option.choices.empty() ? option.value : "value") + ":" +
                (option.choices.empty() ? "_files" : "(" + joined(option.choices, " ") + ")");
  std::string line;
  for (const std::string& name : option.names)
    line += " \\\n    " + quoted(name +
                                 (value.empty()    ? ""
                                  : name[1] == '-' ? "="
                                                   : "+") +
                                 "[" + forArguments(option.what) + "]" + value);
  return line;
}

}  // namespace

std::string bashCompletion(const CommandHelp& program) {
  std::string steps, values, words;
  visitAll(program, "", [&](const std::string& path, const CommandHelp& command) {
    for (const CommandHelp& part : command.commands)
      steps += "      " + quoted(path + "," + part.name) +
               ") command=" + quoted(path.empty() ? part.name : path + " " + part.name) + " ;;\n";
    std::string others;
    for (const OptionHelp& option : command.options) {
      if (option.argument || option.value.empty()) continue;
      std::string patterns;
      for (const std::string& name : option.names)
        patterns += (patterns.empty() ? "" : "|") + quoted(path + "," + name);
      if (option.choices.empty())
        others += (others.empty() ? "" : "|") + patterns;
      else
        values += "    " + patterns + ") COMPREPLY=($(compgen -W " + quoted(joined(option.choices, " ")) +
                  " -- \"$cur\")); return ;;\n";
    }
    if (!others.empty()) values += "    " + others + ") return ;;\n";
    words += "    " + quoted(path) + ") flags=" + quoted(joined(flagsOf(command), " ")) +
             " commands=" + quoted(joined(commandsOf(command), " ")) + " ;;\n";
  });
  return "# Completion of " + program.name + " for bash; printed by '" + program.name +
         " completion bash'.\n"
         "_" +
         program.name +
         "() {\n"
         "  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]}\n"
         "  local command= flags= commands= n\n"
         "  COMPREPLY=()\n"
         "  if [[ $cur == = ]]; then cur=; fi  # --option=value is three words\n"
         "  if [[ $prev == = ]]; then prev=${COMP_WORDS[COMP_CWORD-2]}; fi\n"
         "  for ((n = 1; n < COMP_CWORD; ++n)); do\n"
         "    case \"$command,${COMP_WORDS[n]}\" in\n" +
         steps +
         "    esac\n"
         "  done\n"
         "  case \"$command,$prev\" in\n" +
         values +
         "  esac\n"
         "  case \"$command\" in\n" +
         words +
         "  esac\n"
         "  if [[ $cur == -* ]]; then\n"
         "    COMPREPLY=($(compgen -W \"$flags\" -- \"$cur\"))\n"
         "  else\n"
         "    COMPREPLY=($(compgen -W \"$commands\" -- \"$cur\"))\n"
         "  fi\n"
         "}\n"
         "complete -o bashdefault -o default -F _" +
         program.name + " " + program.name + "\n";
}

std::string zshCompletion(const CommandHelp& program) {
  std::string functions;
  visitAll(program, "", [&](const std::string& path, const CommandHelp& command) {
    std::string name = "_" + program.name + (path.empty() ? "" : " " + path);
    for (char& c : name)
      if (c == ' ') c = '_';
    functions += name + "() {\n";
    if (!command.commands.empty()) functions += "  local -a commands line\n  local state\n";
    functions += "  _arguments -s";
    for (const OptionHelp& option : command.options)
      if (!option.argument) functions += zshSpec(option);
    if (command.commands.empty()) {
      functions += " \\\n    '*:file:_files'\n}\n\n";
      return;
    }
    functions += " \\\n    '1:command:->command' '*::argument:->argument'\n  commands=(";
    for (const CommandHelp& part : command.commands)
      functions += "\n    " + quoted(part.name + ":" + forArguments(part.what));
    functions +=
        ")\n  case $state in\n    command) _describe command commands ;;\n    argument)\n"
        "      case $line[1] in\n";
    for (const CommandHelp& part : command.commands)
      functions += "        " + part.name + ") " + name + "_" + part.name + " ;;\n";
    functions += "      esac ;;\n  esac\n}\n\n";
  });
  return "#compdef " + program.name + "\n# Completion of " + program.name + " for zsh; printed by '" +
         program.name + " completion zsh'.\n\n" + functions + "if [[ $funcstack[1] == _" + program.name +
         " ]]; then _" + program.name + " \"$@\"; else compdef _" + program.name + " " + program.name +
         "; fi\n";
}

}  // namespace vdb_diffuse
