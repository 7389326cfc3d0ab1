#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <sstream>

#include "commands.h"
#include "example.h"
#include "grid/spelling.h"
#include "io/free_memory.h"
#include "io/whole_file.h"
#include "lighting_run.h"
#include "output_folder.h"
#include "plot/chart.h"
#include "reference/path_tracer.h"
#include "report/figure.h"
#include "report_table.h"
#include "stored_truth.h"

namespace vdb_diffuse {
namespace {

constexpr char kMonteCarlo[] = "monte-carlo", kFirstScatter[] = "first-scatter";

/// Of a run's flags, `output` is the folder here.
struct ReportFlags : LightingFlags {
  std::string reference;
  double noise = 0.01, seconds = 0, tolerance = 1e-4;
  uint64_t seed = 1;
  int block = 1, repeats = 3;
  std::vector<std::string> methods;

  bool wantsMethod(const std::string& method) const {
    return methods.empty() || std::find(methods.begin(), methods.end(), method) != methods.end();
  }
};

std::vector<std::string> methodNames() {
  std::vector<std::string> names;
  for (const Method& method : methods()) names.push_back(method.name);
  names.push_back(kMonteCarlo);
  names.push_back(kFirstScatter);
  return names;
}

void checkWords(const ReportFlags& flags) {
  const std::vector<std::string> known = methodNames();
  for (const std::string& method : flags.methods) {
    if (std::find(known.begin(), known.end(), method) != known.end()) continue;
    const std::string nearest = nearestSpelling(method, known);
    throw UsageError(
        "--methods: there is no '" + method + "'" +
        (nearest.empty() ? "; choose from " + commaList(known) : "; did you mean " + nearest + "?"));
  }
  if (!(flags.noise > 0 && flags.noise < 1)) throw UsageError("--noise: a number between 0 and 1 is needed");
  if (!(flags.seconds >= 0 && std::isfinite(flags.seconds)))
    throw UsageError("--seconds: a number above 0 is needed");
  if (!(flags.tolerance > 0 && flags.tolerance < 1))
    throw UsageError("--tolerance: a number between 0 and 1 is needed");
}

Medium readMedium(const ReportFlags& flags, const SceneFile& scene, std::vector<std::string>& warnings) {
  if (scene.scene.lights.empty() && !scene.medium.emission && !scene.medium.temperature)
    throw UsageError("no light: every method would be right; give one with --sun, --env or --scene");
  Medium medium = flags.readMedium(VdbFile(flags.input), scene.medium, warnings);
  const Field<float>& rho = medium.density.values;
  if (std::all_of(rho.data(), rho.data() + rho.size(), [](float v) { return v == 0; }))
    throw InputError(flags.input + ": grid " + medium.density.name +
                     ": is zero everywhere: there is nothing to measure");
  return medium;
}

/// Names the volume in what a method refuses.
template <typename Work>
auto naming(const std::string& what, const Work& work) {
  try {
    return work();
  } catch (const InputError& error) {
    throw InputError(what + ": " + error.what());
  }
}

/// A stored reference does not say what lit it, but its direct light does.
void checkLight(const ReportFlags& flags, const Medium& medium, const Scene& scene, const Truth& truth,
                const Progress& progress, std::vector<std::string>& warnings) {
  constexpr double kSame = 0.05;  // the two ways to direct light differ by less, on voxels worth the name
  const double excess = directExcess(medium, scene, *truth.direct, truth.density, progress);
  if (std::abs(excess) <= kSame) return;
  std::ostringstream line;
  line << flags.reference << ": its direct light is not this scene's, which is " << std::abs(100 * excess)
       << " % " << (excess > 0 ? "brighter" : "darker") << ": was it made with the same lights?";
  warnings.push_back(line.str());
}

/// The truth, and its own row.
Truth findTruth(const ReportFlags& flags, const Medium& medium, const Scene& scene, const Progress& progress,
                Measurement& row, std::vector<std::string>& warnings) {
  Truth truth;
  row.method = "reference";
  if (!flags.reference.empty()) {
    truth = readTruth(flags.reference, medium, warnings);
    row.setting = "stored";
    truth.density = gridValues(medium, {medium.density.values});
    if (truth.direct) checkLight(flags, medium, scene, truth, progress, warnings);
  } else {
    ReferenceSettings settings;
    settings.noise = flags.noise;
    settings.seconds = flags.seconds;
    settings.seed = flags.seed;
    settings.max_bytes = freeMemory();
    settings.progress = progress;
    ReferenceResult result = naming(flags.input, [&] { return reference(medium, scene, settings); });
    row.seconds = result.seconds;
    row.samples = result.samples;
    row.setting = std::to_string(result.samples) + " paths";
    row.closure = result.energy.closure();
    warnings.insert(warnings.end(), result.warnings.begin(), result.warnings.end());
    truth.diffuse = gridValues(medium, std::move(result.diffuse));
    truth.standard_error = gridValues(medium, std::move(result.diffuse_se));
    truth.seed = settings.seed;
  }
  truth.density = gridValues(medium, {medium.density.values});
  row.errors = {truth.norms(1), truth.norms(4), truth.norms(flags.block)};
  if (!(row.errors.voxels.mean > 0))
    throw InputError(flags.input +
                     ": the reference is dark: no light reaches the density, or nothing scatters");
  return truth;
}

std::vector<Measurement> measureAll(const ReportFlags& flags, const Medium& medium, const Scene& scene,
                                    const Progress& progress, std::vector<std::string>& warnings) {
  std::vector<Measurement> rows;
  const auto add = [&](Measurement row) {
    for (const std::string& warning : row.warnings) warnings.push_back(row.method + ": " + warning);
    rows.push_back(std::move(row));
  };
  Measurement own;
  const Truth truth = findTruth(flags, medium, scene, progress, own, warnings);
  const MeasureSettings settings{flags.block, flags.tolerance, flags.repeats, progress};
  for (const Method& method : methods())
    if (flags.wantsMethod(method.name)) {
      const std::string what = flags.input + ": " + method.name;
      add(naming(what, [&] { return measure(method, medium, scene, truth, settings); }));
    }
  if (flags.wantsMethod(kMonteCarlo)) {
    MonteCarloSettings monte_carlo;
    monte_carlo.max_bytes = freeMemory();
    if (own.seconds > 0) monte_carlo.seconds = own.seconds;
    for (Measurement& row : measureMonteCarlo(medium, scene, truth, settings, monte_carlo))
      add(std::move(row));
  }
  add(std::move(own));
  if (flags.wantsMethod(kFirstScatter))
    for (Measurement& row : measureFirstScatter(medium, scene, truth, settings)) add(std::move(row));
  compareWithMonteCarlo(rows);
  return rows;
}

std::string grouped(size_t n) {
  std::string digits = std::to_string(n);
  for (int at = static_cast<int>(digits.size()) - 3; at > 0; at -= 3)
    digits.insert(static_cast<size_t>(at), ",");
  return digits;
}

/// Medium and light in one line.
std::string subtitleOf(const Medium& medium, const Scene& scene, int threads) {
  std::ostringstream line;
  const auto rgb = [&](const Vec3d& v) {
    line << v[0];
    if (v[1] != v[0] || v[2] != v[0]) line << "/" << v[1] << "/" << v[2];
  };
  line << "scattering ";
  rgb(medium.optics.sigma_s);
  if (!medium.albedo.empty()) line << " times an albedo grid";
  line << ", absorption ";
  rgb(medium.optics.sigma_a);
  line << ", g " << medium.optics.g << " · ";
  static const char* const kKinds[] = {"sun", "point light", "spot light", "area light", "dome"};
  std::vector<std::string> words;
  for (const NamedLight& light : scene.lights)
    if (const char* kind = kKinds[light.light.index()];
        std::find(words.begin(), words.end(), kind) == words.end())
      words.push_back(kind);
  if (!medium.emission.empty()) words.push_back("emission");
  if (!scene.surfaces.empty()) words.push_back("surfaces");
  line << commaList(words) << " · " << threads << (threads == 1 ? " thread" : " threads");
  return line.str();
}

void run(const ReportFlags& flags, ExitStatus& status) {
  checkWords(flags);
  const SceneFile scene = flags.scene.resolve();
  const OutputFolder folder(flags.output, {"report.csv", "report.svg", "report.png"});
  const auto limit = flags.limitThreads();
  std::vector<std::string> warnings;
  const Medium medium = readMedium(flags, scene, warnings);
  const std::vector<Measurement> rows =
      measureAll(flags, medium, scene.scene, makeProgress(flags.progress), warnings);

  FigureWords words;
  words.title = "Speed against error: " + std::filesystem::path(flags.input).filename().string() + ", " +
                grouped(medium.topology().activeVoxelCount()) + " voxels";
  words.subtitle = subtitleOf(medium, scene.scene, flags.threadCount());
  words.block = flags.block;
  for (const Measurement& row : rows)
    if (row.method == "reference") words.noise = row.errors.blocks.noise;
  const Chart chart = figureOf(rows, words);
  writeWholeFiles({{folder.file("report.csv"), reportCsv(rows, flags.block, flags.threadCount())},
                   {folder.file("report.svg"), drawChart(chart, PictureFormat::kSvg)},
                   {folder.file("report.png"), drawChart(chart, PictureFormat::kPng)}});

  for (const std::string& warning : warnings) flags.progress.logOf("report").warning(warning);
  if (!flags.progress.quiet) {
    std::cout << reportTable(rows, flags.block);
    const std::string verdict = reportVerdict(rows, flags.block);
    if (!verdict.empty()) std::cout << verdict << "\n";
  }
  for (const Measurement& row : rows) {
    if (row.converged) continue;
    std::cerr << "vdb_diffuse report: " << flags.input << ": " << row.method
              << " did not reach the tolerance " << flags.tolerance
              << "; the report is written and says so\n";
    status = ExitStatus::kNotConverged;
  }
}

}  // namespace

void addReport(CLI::App& program, ExitStatus& status) {
  CLI::App* command = program.add_subcommand(
      "report", "Speed against error of all methods on one volume: a table and a picture");
  const auto flags = std::make_shared<ReportFlags>();
  command->add_option("IN.vdb", flags->input, "Volume with a density grid")->required();
  command
      ->add_option("-o,--output", flags->output,
                   "Folder for report.csv, report.svg and report.png; made if missing")
      ->type_name("DIR")
      ->required();
  flags->scene.addTo(*command);
  const std::string reference = "Reference", method = "Method";
  CLI::Option* noise =
      command
          ->add_option("--noise", flags->noise,
                       "Relative noise per voxel at which the reference, a long Monte Carlo run, is done")
          ->group(reference)
          ->capture_default_str();
  CLI::Option* seconds =
      command->add_option("--seconds", flags->seconds, "The reference takes no longer (default: no limit)")
          ->group(reference);
  CLI::Option* seed = command->add_option("--seed", flags->seed, "Of the reference; the methods use others")
                          ->group(reference);
  command
      ->add_option(
          "--reference", flags->reference,
          "Take one that exists: grids diffuse and diffuse_se of FILE.vdb, as 'vdb_diffuse reference' "
          "writes them for the same volume, medium and light")
      ->type_name("FILE.vdb")
      ->group(reference)
      ->excludes(noise)
      ->excludes(seconds)
      ->excludes(seed);
  command->add_option("--methods", flags->methods, "Of " + commaList(methodNames()) + " (default: all)")
      ->delimiter(',')
      ->type_name("NAME,...")
      ->group(method);
  command
      ->add_option(
          "--block", flags->block,
          "Show errors of averages over blocks of N^3 voxels; the table has those of voxels and 4^3 too")
      ->check(CLI::Range(1, 1 << 20))
      ->type_name("N")
      ->group(method)
      ->capture_default_str();
  command
      ->add_option("--repeats", flags->repeats,
                   "Runs of which the time is the median, for methods of less than 5 s")
      ->check(CLI::Range(1, 1000))
      ->group(method)
      ->capture_default_str();
  command->add_option("--tolerance", flags->tolerance, "Of the solves, on the scaled residual")
      ->group(method)
      ->capture_default_str();
  command->add_option("--threads", flags->threads, "At most this many (default: all)")
      ->check(CLI::PositiveNumber)
      ->group(method);
  command
      ->add_flag("--clamp", flags->clamp,
                 "Take densities that are not finite or negative as 0, not as an error")
      ->group(method);
  addProgressFlags(command, flags->progress);
  setExample(command,
             "vdb_diffuse report cloud.vdb -o report --sun 1,0.5,-1 --env 0.3 --noise 0.02\n"
             "vdb_diffuse reference cloud.vdb -o reference.vdb --sun 1,0.5,-1 --noise 0.005\n"
             "vdb_diffuse report cloud.vdb -o report --sun 1,0.5,-1 --reference reference.vdb");
  command->footer(
      "Errors are relative RMS over the volume, weighted by density, the reference's noise taken off, of\n"
      "`diffuse`. Times are wall clock, without reading and writing. The rows beams and march are two ways "
      "to\n"
      "the first scatter: their errors are against each other, of `direct`.\n\n" +
      command->get_footer());
  command->callback([flags, &status] { run(*flags, status); });
}

}  // namespace vdb_diffuse
