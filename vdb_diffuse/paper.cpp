#include "paper/part.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>

#include "commands.h"
#include "example.h"
#include "grid/spelling.h"
#include "io/whole_file.h"
#include "lighting_run.h"
#include "output_folder.h"

namespace vdb_diffuse {
namespace {

struct PaperFlags {
  std::string output;
  std::vector<std::string> only;
  int threads = 0, relaxations = PaperSettings().relaxations, depth = PaperSettings().depth;
  double effort = 1;
  ProgressFlags progress;

  bool wants(const PaperPart& part) const {
    return only.empty() || std::find(only.begin(), only.end(), part.name) != only.end();
  }
};

std::vector<std::string> partNames() {
  std::vector<std::string> names;
  for (const PaperPart& part : paperParts()) names.push_back(part.name);
  return names;
}

void checkWords(PaperFlags& flags) {
  const std::vector<std::string> known = partNames();
  for (std::string& word : flags.only) {
    if (word == "fig4") word = "fig5";  // one part makes both
    if (std::find(known.begin(), known.end(), word) != known.end()) continue;
    const std::string nearest = nearestSpelling(word, known);
    throw UsageError(
        "--only: there is no '" + word + "'" +
        (nearest.empty() ? "; choose from " + commaList(known) : "; did you mean " + nearest + "?"));
  }
}

void run(PaperFlags& flags) {
  checkWords(flags);
  const OutputFolder folder(flags.output, {"claims.csv"});
  std::unique_ptr<tbb::global_control> limit;
  if (flags.threads > 0)
    limit =
        std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, flags.threads);
  PaperSettings settings;
  settings.relaxations = flags.relaxations;
  settings.depth = flags.depth;
  settings.effort = flags.effort;
  std::vector<Claim> claims;
  const Log log = flags.progress.logOf("paper");
  for (const PaperPart& part : paperParts()) {
    if (!flags.wants(part)) continue;
    settings.progress = under(part.name, makeProgress(flags.progress));
    const double start = secondsNow();
    const PaperResult result = part.run(settings);
    std::vector<std::pair<std::string, std::string>> files;
    for (const auto& [name, bytes] : result.files) files.emplace_back(folder.file(name), bytes);
    writeWholeFiles(files);
    claims.insert(claims.end(), result.claims.begin(), result.claims.end());
    log.info(part.name + ": " + number(secondsNow() - start, "%.3g") + " s");
  }
  writeWholeFiles({{folder.file("claims.csv"), claimsCsv(claims)}});
  if (!flags.progress.quiet) std::cout << claimsTable(claims);
}

}  // namespace

void addPaper(CLI::App& program, ExitStatus&) {
  CLI::App* command = program.add_subcommand(
      "paper", "The figures and claims of Stam (1995), reproduced and measured: pictures and tables");
  const auto flags = std::make_shared<PaperFlags>();
  command
      ->add_option("-o,--output", flags->output,
                   "Folder for the pictures, their numbers and claims.csv; made if missing")
      ->type_name("DIR")
      ->required();
  std::string list = "Some parts alone, of " + commaList(partNames());
  command->add_option("--only", flags->only, list)->delimiter(',')->type_name("PART,...");
  command->add_option("--relaxations", flags->relaxations, "Of a v-cycle in the plane, on each grid and way")
      ->check(CLI::Range(1, 1000))
      ->type_name("N")
      ->capture_default_str();
  command->add_option("--depth", flags->depth, "Grids of a v-cycle in the plane, 0: as many as can be halved")
      ->check(CLI::Range(0, 30))
      ->type_name("N")
      ->capture_default_str();
  command
      ->add_option("--effort", flags->effort,
                   "Factor on the paths of Monte Carlo: its noise falls with the root")
      ->check(CLI::Range(1e-3, 1e6))
      ->type_name("V")
      ->capture_default_str();
  command->add_option("--threads", flags->threads, "At most this many (default: all)")
      ->check(CLI::PositiveNumber)
      ->type_name("N");
  addProgressFlags(command, flags->progress);
  setExample(command,
             "vdb_diffuse paper -o paper\n"
             "vdb_diffuse paper -o paper --only fig3,map\n"
             "vdb_diffuse paper -o paper --only fig2 --relaxations 2 --depth 9");
  std::string parts = "Parts:\n";
  for (const PaperPart& part : paperParts())
    parts += "  " + part.name + std::string(13 - part.name.size(), ' ') + part.words + "\n";
  command->footer(parts + "\n" + command->get_footer());
  command->callback([flags] { run(*flags); });
}

}  // namespace vdb_diffuse
