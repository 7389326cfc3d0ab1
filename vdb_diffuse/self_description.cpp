#include <iostream>
#include <memory>

#include "command_help.h"
#include "commands.h"
#include "example.h"

namespace vdb_diffuse {

void addCompletion(CLI::App& program, ExitStatus&) {
  CLI::App* command = program.add_subcommand(
      "completion", "Prints a script with which a shell completes commands and options");
  const auto shell = std::make_shared<std::string>();
  command->add_option("SHELL", *shell, "bash or zsh")->required()->check(CLI::IsMember({"bash", "zsh"}));
  setExample(command,
             "source <(vdb_diffuse completion bash)\n"
             "vdb_diffuse completion bash > ~/.local/share/bash-completion/completions/vdb_diffuse\n"
             "vdb_diffuse completion zsh > ~/.zfunc/_vdb_diffuse");
  command->callback([shell, &program] {
    const CommandHelp help = helpOf(program);
    std::cout << (*shell == "bash" ? bashCompletion(help) : zshCompletion(help));
  });
}

void addMan(CLI::App& program, ExitStatus&) {
  CLI::App* command = program.add_subcommand("man", "Prints the manual's page: all help in one, as troff");
  setExample(command, "vdb_diffuse man | man -l -");
  command->callback(
      [&program] { std::cout << manualPage(helpOf(program), "vdb_diffuse " VDB_DIFFUSE_VERSION); });
}

}  // namespace vdb_diffuse
