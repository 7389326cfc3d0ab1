#include <algorithm>
#include <cctype>

#include "command_help.h"

namespace vdb_diffuse {
namespace {

/// Text that troff shows as it is: no escapes, no requests at a line's start, and minus signs one can paste.
std::string plain(const std::string& text) {
  std::string out;
  bool line_start = true;
  for (const char c : text) {
    if (line_start && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
    line_start = c == '\n';
  }
  return out;
}

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

/// "-o, --output FILE" in the manual's types.
std::string termOf(const OptionHelp& option) {
  std::string term;
  for (const std::string& name : option.names)
    term += (term.empty() ? "" : ", ") + ("\\fB" + plain(name) + "\\fR");
  if (!option.argument && !option.value.empty()) term += " \\fI" + plain(option.value) + "\\fR";
  return term;
}

std::string itemOf(const OptionHelp& option) {
  std::string text = option.what;
  if (!option.fallback.empty() && text.find("default:") == std::string::npos)
    text += " (default: " + option.fallback + ")";
  if (option.required && !option.argument) text += " (needed)";
  return ".TP\n" + termOf(option) + "\n" + plain(text) + "\n";
}

std::string verbatim(const std::string& text) {
  return ".PP\n.nf\n" + plain(text) + (text.empty() || text.back() != '\n' ? "\n" : "") + ".fi\n";
}

std::string optionsOf(const CommandHelp& command) {
  std::string page, group;
  for (const OptionHelp& option : command.options) {
    if (option.group != group) {
      group = option.group;
      page += ".PP\n\\fI" + plain(group) + "\\fR\n";
    }
    page += itemOf(option);
  }
  return page;
}

std::string argumentsOf(const CommandHelp& command) {
  std::string line;
  for (const OptionHelp& option : command.options)
    if (option.argument)
      line += " " + (option.required ? plain(option.names[0]) : "[" + plain(option.names[0]) + "]");
  if (!command.commands.empty()) line += " \\fICOMMAND\\fR";
  return line;
}

void addCommand(const CommandHelp& command, const std::string& path, std::string& page) {
  page += ".SH " + upper(path.substr(path.find(' ') + 1)) + "\n";
  page += "\\fB" + plain(path) + "\\fR" + argumentsOf(command) + " [\\fIoptions\\fR]\n.PP\n";
  page += plain(command.what) + ".\n" + optionsOf(command);
  if (!command.footer.empty()) page += verbatim(command.footer);
  for (const CommandHelp& part : command.commands) addCommand(part, path + " " + part.name, page);
}

}  // namespace

std::string manualPage(const CommandHelp& program, const std::string& version) {
  std::string page = ".TH " + upper(program.name) + " 1 \"\" \"" + plain(version) + "\"\n";
  std::string what = program.what;
  if (!what.empty() && what.back() == '.') what.pop_back();
  page += ".SH NAME\n" + plain(program.name) + " \\- " + plain(what) + "\n";
  page += ".SH SYNOPSIS\n\\fB" + plain(program.name) + "\\fR \\fICOMMAND\\fR [\\fIarguments\\fR]\n";
  page += ".SH COMMANDS\n";
  for (const CommandHelp& command : program.commands)
    page += ".TP\n\\fB" + plain(command.name) + "\\fR\n" + plain(command.what) + "\n";
  page += ".SH OPTIONS\n" + optionsOf(program);
  for (const CommandHelp& command : program.commands)
    addCommand(command, program.name + " " + command.name, page);
  page += ".SH EXAMPLES\n" + verbatim(program.footer);
  return page;
}

}  // namespace vdb_diffuse
