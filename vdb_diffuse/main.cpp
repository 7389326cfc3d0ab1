#include <iostream>
#include <limits>

#include "commands.h"
#include "example.h"
#include "grid/spelling.h"
#include "interrupt.h"
#include "log.h"

namespace vdb_diffuse {
namespace {

int report(const std::string& command, std::string what, ExitStatus status) {
  const std::string largest = std::to_string(std::numeric_limits<double>::max());  // CLI11's "no upper limit"
  if (const size_t at = what.find(largest); at != std::string::npos)
    what.replace(at, largest.size(), "infinity");
  Log(command).error(what);
  return static_cast<int>(status);
}

std::vector<std::string> commandNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

std::vector<std::string> flagNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  return names;
}

bool has(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

std::string unknown(const std::string& kind, const std::string& word, const std::vector<std::string>& known) {
  const std::string nearest = nearestSpelling(word, known);
  return "unknown " + kind + " " + word + (nearest.empty() ? "" : "; did you mean " + nearest + "?");
}

/// The first word of the command line that no command or option goes by, explained; empty where all are
/// known. CLI11 stops at the first thing missing, which for a mistyped option is not what the user needs to
/// hear.
std::string unknownWord(const CLI::App& program, int argc, char** argv) {
  const CLI::App* app = &program;
  for (int n = 1; n < argc; ++n) {
    const std::string word = argv[n];
    if (word == "--") return "";
    if (word.size() > 2 && word[0] == '-' && word[1] == '-') {
      const std::string flag = word.substr(0, word.find('='));
      if (!has(flagNames(*app), flag)) return unknown("option", flag, flagNames(*app));
    } else if (word.size() == 2 && word[0] == '-' && std::isalpha(static_cast<unsigned char>(word[1]))) {
      if (!has(flagNames(*app), word)) return unknown("option", word, {});
    } else if (has(commandNames(*app), word)) {
      app = app->get_subcommand(word);
    } else if (app == &program) {
      return unknown("command", word, commandNames(program));
    }
  }
  return "";
}

int run(int argc, char** argv) {
  CLI::App program("Precomputes the light inside sparse OpenVDB volumes.", "vdb_diffuse");
  ExitStatus status = ExitStatus::kDone;
  program.require_subcommand(0, 1);
  addBake(program, status);
  addCheck(program, status);
  addCompare(program, status);
  addCompletion(program, status);
  addInfo(program, status);
  addMake(program, status);
  addMan(program, status);
  addPaper(program, status);
  addReference(program, status);
  addRender(program, status);
  addReport(program, status);
  setExample(&program,
             "vdb_diffuse make cloud -o cloud.vdb\n"
             "vdb_diffuse bake cloud.vdb -o lit.vdb --sun 1,0.5,-1 --env 0.3\n"
             "vdb_diffuse render lit.vdb -o lit.png");
  const std::string version = "vdb_diffuse " VDB_DIFFUSE_VERSION;
  program.set_version_flag("--version", version, "print the version and exit");
  for (CLI::App* command : program.get_subcommands([](CLI::App*) { return true; }))
    command->set_version_flag("--version", version, "print the version and exit");

  std::string command;
  for (int n = 1; n < argc && command.empty(); ++n)
    if (has(commandNames(program), argv[n])) command = argv[n];
  try {
    program.parse(argc, argv);
    if (program.get_subcommands().empty()) {
      std::cerr << program.help();
      return static_cast<int>(ExitStatus::kUsage);
    }
    std::cout.flush();
    if (!std::cout) throw OutputError("standard output could not be written");
    return static_cast<int>(status);
  } catch (const CLI::Success& request) {  // --help, --version
    return program.exit(request);
  } catch (const CLI::ParseError& error) {
    const std::string word = unknownWord(program, argc, argv);
    const std::string help = "; see vdb_diffuse " + (command.empty() ? "" : command + " ") + "--help";
    return report(command,
                  word.empty()         ? error.what() + help
                  : word.back() == '?' ? word
                                       : word + help,
                  ExitStatus::kUsage);
  } catch (const Error& error) {
    return report(command, error.what(), error.status());
  } catch (const std::bad_alloc&) {
    return report(command, "not enough memory; free some, or use a smaller volume",
                  ExitStatus::kOutputNotWritten);
  } catch (const std::exception& error) {  // OpenVDB's among them, where no better words were found
    return report(command, error.what(), ExitStatus::kInputRefused);
  }
}

}  // namespace
}  // namespace vdb_diffuse

int main(int argc, char** argv) {
  vdb_diffuse::catchSignals();
  return vdb_diffuse::run(argc, argv);
}
