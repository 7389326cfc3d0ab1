#include <tbb/global_control.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>

#include "bake.h"
#include "check/cases_file.h"
#include "check/cell_means.h"
#include "check/difference_picture.h"
#include "check/junit.h"
#include "commands.h"
#include "example.h"
#include "grid/norms.h"
#include "grid/spelling.h"
#include "interrupt.h"
#include "io/atomic_file.h"
#include "io/whole_file.h"

namespace vdb_diffuse {
namespace {

constexpr char kFormat[] =
    "CASES.json lists volumes, how to bake them, and how near the grids must come to those stored:\n"
    "  { \"defaults\": { \"max_rms\": 0.01, \"max_abs\": 0.1, \"block\": 2 },\n"
    "    \"cases\": [ { \"name\": \"cloud_noon\", \"volume\": \"cloud.vdb\", \"bake\": \"--sun 0,0,-1 --env "
    "0.3\" },\n"
    "               { \"name\": \"cloud_dusk\", \"volume\": \"$SHOW/cloud.vdb\", \"bake\": \"--scene "
    "dusk.json\",\n"
    "                 \"grids\": [\"diffuse\"], \"max_rms\": 0.02, \"stored\": \"accepted/dusk.vdb\" } ] }\n"
    "  name      of the case, and of its files; letters, digits and . _ -\n"
    "  volume    VDB file; may begin with an environment variable\n"
    "  bake      flags of `bake` for volume, medium, light and method; none of its output\n"
    "  stored    result to hold it against (default: NAME.vdb); made by --update, in 16-bit floats\n"
    "  grids     that are compared (default: diffuse and direct); flux and source are others\n"
    "  max_rms, max_abs   limits as of `compare`, fractions: relative RMS, and largest difference over the\n"
    "            mean; one of them at least. Storing in 16 bits costs up to 0.0005 of a value\n"
    "  block     store and compare means of cells of so many voxels a side (default 1): small files;\n"
    "            places are told by the lowest voxel of a cell\n"
    "All paths are relative to CASES.json. `defaults` may hold bake, grids, max_rms, max_abs and block.\n\n"
    "Exit status: 0 all within their limits; 1 one or more outside; 3 one or more could not be run; 5 a "
    "file\n"
    "could not be written; the highest counts.";

struct CheckFlags {
  std::string cases, output = "check_out", junit;
  std::vector<std::string> only;
  bool update = false;
  int threads = 0;
  ProgressFlags progress;
};

/// A case with its words understood.
struct CheckJob {
  CheckCase test;
  BakeFlags bake;
};

void parseWords(const std::string& words, BakeFlags& flags) {
  CLI::App app;
  app.set_help_flag("");
  flags.addVolumeTo(app);
  flags.scene.addTo(app);
  flags.addMethodTo(app);
  app.parse(words);
}

std::vector<CheckJob> jobsOf(const CheckFlags& flags) {
  std::vector<CheckJob> jobs;
  std::vector<std::string> names;
  for (const CheckCase& test : readCases(flags.cases)) {
    names.push_back(test.name);
    if (!flags.only.empty() && std::find(flags.only.begin(), flags.only.end(), test.name) == flags.only.end())
      continue;
    CheckJob job{test, {}};
    try {
      parseWords(test.bake, job.bake);
    } catch (const CLI::ParseError& error) {
      throw InputError(flags.cases + ": " + test.name + ": bake: " + error.what());
    }
    const auto folder = std::filesystem::path(flags.cases).parent_path();
    for (std::string* path : job.bake.scene.paths()) *path = (folder / *path).string();
    job.bake.input = test.volume;
    job.bake.grids = test.grids;
    job.bake.threads = flags.threads;
    jobs.push_back(std::move(job));
  }
  for (const std::string& name : flags.only)
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw UsageError("--only " + name + ": no such case; " + flags.cases + " has " + commaList(names));
  return jobs;
}

std::string percent(double fraction) {
  char text[40];
  std::snprintf(text, sizeof text, "%.3g %%", 100 * fraction);
  return text;
}

std::string at(const Coord& p) {
  return "(" + std::to_string(p[0]) + "," + std::to_string(p[1]) + "," + std::to_string(p[2]) + ")";
}

/// Where a cell of the compared grids begins.
Coord voxelOf(const CheckCase& test, const Coord& cell) {
  return Coord(cell[0] * test.block, cell[1] * test.block, cell[2] * test.block);
}

std::string valueAt(const GridValues& grid, const Coord& p) {
  std::string text;
  for (size_t c = 0; c < grid.channels.size(); ++c) {
    char value[40];
    std::snprintf(value, sizeof value, "%s%.4g", c ? "," : "",
                  grid.channels[c].at(*grid.topology, p, grid.background[c]));
    text += value;
  }
  return text;
}

/// One grid held against the stored one.
struct GridVerdict {
  std::string grid, found;  ///< "relative RMS 0.1 %, largest 2 % at (1,2,3)"
  std::string fault;        ///< empty: within the limits
  GridValues stored, now;
  Norms norms;
};

GridVerdict gridVerdict(const CheckCase& test, const VdbFile& stored, const std::string& grid,
                        const GridValues& now) {
  GridVerdict verdict{grid, "", "", {}, now, {}};
  stored.require(grid, "accept what is baked now with --update");
  verdict.stored = stored.readValues(grid);
  try {
    verdict.norms = compareGrids(now, verdict.stored, nullptr, nullptr, 1);
  } catch (const InputError& error) {
    throw InputError(test.stored + ": " + error.what() + "; if that is meant, accept it with --update");
  }
  const Norms& norms = verdict.norms;
  verdict.found = "relative RMS " + percent(norms.rel_rms) + ", largest " + percent(norms.max) + " at " +
                  at(voxelOf(test, norms.max_at));
  if (test.max_rms && !(norms.rel_rms <= *test.max_rms))
    verdict.fault = "max_rms is " + percent(*test.max_rms);
  if (test.max_abs && !(norms.max <= *test.max_abs))
    verdict.fault += (verdict.fault.empty() ? "" : ", ") + ("max_abs is " + percent(*test.max_abs));
  if (!verdict.fault.empty())
    verdict.fault += "; there " + valueAt(verdict.stored, norms.max_at) + " is stored, now it is " +
                     valueAt(verdict.now, norms.max_at);
  if (norms.nonfinite > 0) verdict.fault = std::to_string(norms.nonfinite) + " values are not finite";
  return verdict;
}

/// Where a file cannot be written, the run ends: nothing after it could report.
std::string drawDifference(const CheckFlags& flags, const CheckCase& test, const GridVerdict& verdict) {
  std::error_code error;
  std::filesystem::create_directories(flags.output, error);
  const std::string path =
      (std::filesystem::path(flags.output) / (test.name + "." + verdict.grid + ".png")).string();
  writeWholeFile(path, differencePicture(verdict.stored, verdict.now, verdict.norms.max_at,
                                         {test.name + ": grid " + verdict.grid,
                                          verdict.found + "; " + verdict.fault, test.block}));
  return path;
}

/// The baked grids as they are stored: means over cells, where the case says so.
std::vector<std::pair<std::string, GridValues>> bakedGrids(const CheckJob& job, Baked& baked) {
  std::vector<std::pair<std::string, GridValues>> grids;
  for (OutputGrid& grid : outputGrids(job.bake, baked)) {
    GridValues values;
    values.topology = baked.medium.density.topology;
    values.transform = baked.medium.transform();
    values.channels = std::move(grid.channels);
    grids.emplace_back(grid.name, job.test.block > 1 ? cellMeans(values, job.test.block) : std::move(values));
  }
  return grids;
}

void store(const CheckCase& test, const std::vector<std::pair<std::string, GridValues>>& baked) {
  Volume where;
  where.topology = baked[0].second.topology;
  where.transform = baked[0].second.transform;
  std::vector<OutputGrid> grids;
  for (const auto& [name, values] : baked) grids.push_back({name, "", values.channels, {}});
  WriteSettings settings;
  settings.half = true;
  settings.metadata["bake"] = test.bake;
  settings.metadata["block"] = test.block;
  std::error_code error;
  const auto folder = std::filesystem::path(test.stored).parent_path();
  if (!folder.empty()) std::filesystem::create_directories(folder, error);
  writeVdb(test.stored, where, std::move(grids), settings);
}

/// Compares all grids. A sentence on how far the baked grids are; `faults` on those that are too far.
std::string compareAll(const CheckFlags& flags, const CheckCase& test,
                       const std::vector<std::pair<std::string, GridValues>>& baked, std::string& faults) {
  const VdbFile stored(test.stored);
  std::string found;
  for (const auto& [name, values] : baked) {
    const GridVerdict verdict = gridVerdict(test, stored, name, values);
    found += (found.empty() ? "" : "; ") + name + ": " + verdict.found;
    if (verdict.fault.empty()) continue;
    faults += (faults.empty() ? "" : "; ") + name + ": " + verdict.found + ", " + verdict.fault;
    if (!flags.update) faults += ", see " + drawDifference(flags, test, verdict);
  }
  return found;
}

JUnitCase runCase(const CheckFlags& flags, const CheckJob& job, const Progress& progress, const Log& log) {
  using Verdict = JUnitCase::Verdict;
  const CheckCase& test = job.test;
  JUnitCase result;
  result.name = test.name;
  const bool stored = std::filesystem::exists(test.stored);
  if (!stored && !flags.update)
    throw InputError(test.stored + ": there is no stored result; accept what is baked now with --update");
  Baked baked = lightVolume(job.bake, job.bake.scene.resolve(), progress);
  for (const std::string& warning : baked.result.warnings) log.warning(test.name + ": " + warning);
  if (!baked.result.converged) {
    result.verdict = Verdict::kFailed;
    result.message = "the solve stopped above its tolerance, at a residual of " +
                     std::to_string(baked.result.relative_residual);
    return result;
  }
  const auto grids = bakedGrids(job, baked);
  if (stored) {
    try {
      result.output = compareAll(flags, test, grids, result.message);
    } catch (const InputError& error) {  // a stored result that is of no use is what --update replaces
      if (!flags.update) throw;
      result.message = error.what();
    }
    if (result.message.empty()) return result;
  }
  if (flags.update) {
    store(test, grids);
    result.output = "accepted as " + test.stored + (stored ? "; before: " + result.message : "");
    result.message.clear();
  } else {
    result.verdict = Verdict::kFailed;
  }
  return result;
}

/// Runs a case to its verdict: only an interrupt, and a file that cannot be written, end the whole run.
JUnitCase verdictOf(const CheckFlags& flags, const CheckJob& job, const Progress& progress, const Log& log) {
  const double start = now();
  JUnitCase result;
  try {
    result = runCase(flags, job, progress, log);
  } catch (const Error& error) {
    if (error.status() == ExitStatus::kInterrupted || error.status() == ExitStatus::kOutputNotWritten) throw;
    result.name = job.test.name;
    result.verdict = JUnitCase::Verdict::kNotRun;
    result.message = error.what();
  }
  result.seconds = now() - start;
  return result;
}

void print(const CheckFlags& flags, const JUnitCase& c, const Log& log) {
  using Verdict = JUnitCase::Verdict;
  if (c.verdict == Verdict::kNotRun) return log.error(c.name + ": " + c.message);
  if (c.verdict == Verdict::kPassed && flags.progress.quiet) return;
  char seconds[40];
  std::snprintf(seconds, sizeof seconds, " (%.2f s)", c.seconds);
  const bool passed = c.verdict == Verdict::kPassed;
  std::cout << (passed ? "ok      " : "FAILED  ") << c.name << ": " << (passed ? c.output : c.message)
            << seconds << std::endl;
}

ExitStatus run(const CheckFlags& flags) {
  using Verdict = JUnitCase::Verdict;
  const std::vector<CheckJob> jobs = jobsOf(flags);
  if (!flags.junit.empty()) AtomicFile probe(flags.junit);
  std::unique_ptr<tbb::global_control> limit;
  if (flags.threads > 0)
    limit =
        std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, flags.threads);

  const Log log = flags.progress.logOf("check");
  std::vector<JUnitCase> results;
  size_t failed = 0, not_run = 0;
  for (const CheckJob& job : jobs) {
    throwIfInterrupted();
    const std::string json_fields = "\"case\":\"" + job.test.name +
                                    "\",\"index\":" + std::to_string(results.size()) +
                                    ",\"cases\":" + std::to_string(jobs.size()) + ",";
    results.push_back(verdictOf(flags, job, makeProgress(flags.progress, json_fields), log));
    print(flags, results.back(), log);
    failed += results.back().verdict == Verdict::kFailed;
    not_run += results.back().verdict == Verdict::kNotRun;
  }
  if (!flags.junit.empty()) writeWholeFile(flags.junit, junitXml(flags.cases, results));
  if (!flags.progress.quiet)
    std::cout << results.size() << " cases: " << results.size() - failed - not_run << " ok, " << failed
              << " outside the tolerance, " << not_run << " not run\n";
  return not_run ? ExitStatus::kInputRefused : failed ? ExitStatus::kOutsideTolerance : ExitStatus::kDone;
}

}  // namespace

void addCheck(CLI::App& program, ExitStatus& status) {
  CLI::App* command = program.add_subcommand(
      "check", "Regression tests: bakes listed volumes, holds them against stored results");
  const auto flags = std::make_shared<CheckFlags>();
  command->add_option("CASES.json", flags->cases, "List of cases, see below")->required();
  command->add_flag(
      "--update", flags->update,
      "Accept: store what is baked now for each case that has nothing stored or is outside its limits");
  command->add_option("--only", flags->only, "Run this case, may be repeated")
      ->type_name("NAME")
      ->allow_extra_args(false);
  command->add_option("--junit", flags->junit, "JUnit XML file to write, for continuous integration")
      ->type_name("FILE.xml");
  command
      ->add_option("-o,--output", flags->output,
                   "Folder for a picture of each grid outside its limits; made when there is one")
      ->type_name("DIR")
      ->capture_default_str();
  command->add_option("--threads", flags->threads, "At most this many; default all")
      ->check(CLI::PositiveNumber);
  addProgressFlags(command, flags->progress);
  setExample(command,
             "vdb_diffuse check tests/cases.json --junit check.xml\n"
             "vdb_diffuse check tests/cases.json --update --only cloud_noon");
  command->footer(std::string(kFormat) + "\n\n" + command->get_footer());
  command->callback([flags, &status] { status = run(*flags); });
}

}  // namespace vdb_diffuse
