#include <tbb/global_control.h>
#include <tbb/info.h>

#include <chrono>
#include <cmath>
#include <iostream>
#include <memory>

#include "commands.h"
#include "example.h"
#include "grid/spelling.h"
#include "io/atomic_file.h"
#include "io/free_memory.h"
#include "io/vdb_writer.h"
#include "progress_bar.h"
#include "scene_options.h"
#include "stats.h"
#include "transport/illuminate.h"

namespace vdb_diffuse {
namespace {

struct BakeFlags {
  std::string input, output, stats;
  SceneOptions scene;
  ProgressFlags progress;
  std::string method = "multigrid", model = "default", cap = "auto";
  double tolerance = 1e-4;
  int threads = 0, dilate = 0, sweeps = 0;
  std::vector<std::string> grids{"density", "diffuse", "direct"}, keep;
  bool half = false, clamp = false, exact_shadows = false;

  bool wants(const std::string& grid) const {
    return std::find(grids.begin(), grids.end(), grid) != grids.end();
  }
};

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

ModelSettings modelOf(const BakeFlags& flags) {
  ModelSettings settings;
  settings.model = flags.model == "p1"      ? Model::kP1
                   : flags.model == "paper" ? Model::kPaper
                                            : Model::kDefault;
  if (flags.cap == "none") settings.mean_free_path_cap = std::numeric_limits<double>::infinity();
  if (flags.cap == "none" || flags.cap == "auto") return settings;
  char* end = nullptr;
  const double length = std::strtod(flags.cap.c_str(), &end);
  if (*end != '\0' || !(length > 0) || !std::isfinite(length))
    throw UsageError("--mean-free-path-cap: '" + flags.cap + "' is not auto, none or a length above 0");
  settings.mean_free_path_cap = length;
  return settings;
}

void checkWords(const BakeFlags& flags) {
  static const std::vector<std::string> kGrids{"density", "diffuse", "direct", "flux", "source"};
  for (const std::string& grid : flags.grids) {
    if (std::find(kGrids.begin(), kGrids.end(), grid) != kGrids.end()) continue;
    const std::string nearest = nearestSpelling(grid, kGrids);
    throw UsageError("--grids: there is no '" + grid + "'" +
                     (nearest.empty() ? "; choose from density,diffuse,direct,flux,source"
                                      : "; did you mean " + nearest + "?"));
  }
  if (!(flags.tolerance > 0 && flags.tolerance < 1))
    throw UsageError("--tolerance: a number between 0 and 1 is needed");
  if (flags.threads < 0) throw UsageError("--threads: a number above 0 is needed");
  if (sameFile(flags.input, flags.output))
    throw UsageError(flags.output + ": is the input itself; give -o another name");
  if (!flags.stats.empty() && (flags.stats == flags.output || sameFile(flags.stats, flags.input)))
    throw UsageError("--stats: " + flags.stats + " is the input or the output; give it another name");
  for (const std::string& path : {flags.output, flags.stats})
    if (!path.empty()) AtomicFile probe(path);  // a folder one may not write to is found before the work
}

/// Refuses a bake that would not fit, before it allocates. Counted in 4-byte fields over the blocks: density,
/// and per channel the light, its vector means, and the results; then one solve.
void checkMemory(const std::string& path, const Medium& medium, bool flux) {
  const bool anisotropic = medium.optics.g != 0;
  const double per_channel =
      2 + (medium.optics.g > 0 ? 1 : 0) + (anisotropic || flux ? 3 : 0) + (flux ? 3 : 0);
  constexpr double kSolve =
      12;  // r, p, q, z, b, x in double, operator of the finest level and the coarse ones
  const double fields = 1 + 3 * per_channel + (flux ? 6 : 0) + kSolve;
  const double need = fields * sizeof(float) * kBlockVoxels * medium.topology().blockCount();
  const double free = static_cast<double>(freeMemory());
  constexpr double kGiB = 1024.0 * 1024 * 1024;
  if (need <= free) return;
  char line[160];
  std::snprintf(line, sizeof line,
                ": baking it may take %.1f GiB and %.1f GiB are free; use a coarser volume", need / kGiB,
                free / kGiB);
  throw InputError(path + line);
}

Metadata settingsOf(const BakeFlags& flags, const Medium& medium, const MediumSettings& words,
                    const DiffuseResult& result) {
  Metadata m;
  m["generator"] = std::string("vdb_diffuse " VDB_DIFFUSE_VERSION);
  const char* suffix[] = {"_r", "_g", "_b"};
  for (int c = 0; c < 3; ++c) {
    m[std::string("sigma_s") + suffix[c]] = medium.optics.sigma_s[c];
    m[std::string("sigma_a") + suffix[c]] = medium.optics.sigma_a[c];
  }
  m["g"] = medium.optics.g;
  m["emission_scale"] = medium.optics.emission_scale;
  if (words.emission) m["emission"] = *words.emission;
  m["density"] = medium.density.name;
  m["model"] = flags.model;
  m["method"] = flags.method;
  m["mean_free_path_cap"] = result.mean_free_path_cap;
  m["tolerance"] = flags.tolerance;
  m["iterations"] = result.iterations;
  m["relative_residual"] = result.relative_residual;
  m["converged"] = result.converged ? 1 : 0;
  return m;
}

std::vector<OutputGrid> outputGrids(const BakeFlags& flags, const Medium& medium, const Metadata& metadata,
                                    DiffuseResult& result) {
  std::vector<OutputGrid> grids;
  Channels source;
  if (flags.wants("source")) source = sourceField(medium, result.direct);
  if (flags.wants("diffuse")) grids.push_back({"diffuse", "W/m^2/sr", std::move(result.diffuse), metadata});
  if (flags.wants("direct")) grids.push_back({"direct", "W/m^2/sr", std::move(result.direct), metadata});
  if (flags.wants("flux")) {
    Channels components;
    for (Field<float>& component : result.flux) components.push_back(std::move(component));
    grids.push_back({"flux", "W/m^2", std::move(components), metadata});
  }
  if (flags.wants("source"))
    grids.push_back({"source", "W/m^2/sr per unit length", std::move(source), metadata});
  return grids;
}

void run(const BakeFlags& flags, ExitStatus& status) {
  const double start = now();
  checkWords(flags);
  const ModelSettings model = modelOf(flags);
  const SceneFile scene = flags.scene.resolve();
  std::unique_ptr<tbb::global_control> limit;
  if (flags.threads > 0)
    limit =
        std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, flags.threads);
  const Progress progress = makeProgress(flags.progress);
  if (progress) progress("read", 0);

  BakeStats stats;
  stats.threads = flags.threads > 0 ? std::min(flags.threads, tbb::info::default_concurrency())
                                    : tbb::info::default_concurrency();
  const VdbFile file(flags.input);
  ReadSettings reading;
  reading.clamp = flags.clamp;
  Medium medium;
  medium.density = file.readDensity(scene.medium.density.value_or(""), reading);
  medium.optics = opticsOf(scene.medium);
  if (scene.medium.emission) medium.emission = file.readOnto(*scene.medium.emission, medium.density, reading);
  stats.active_voxels = medium.topology().activeVoxelCount();
  stats.voxel_size = medium.transform().meanVoxelSize();
  stats.read = now() - start;
  checkMemory(flags.input, medium, flags.wants("flux"));

  DiffuseSettings settings;
  settings.model = model;
  settings.tolerance = flags.tolerance;
  settings.source.exact_march = flags.exact_shadows;
  settings.want_flux = flags.wants("flux");
  settings.progress = progress;
  TransportSettings transport;
  transport.sweeps = flags.sweeps;
  DiffuseResult result = illuminate(medium, scene.scene, settings, transport);
  if (stats.active_voxels == 0) result.warnings.push_back("the density has no active voxels");

  const double write_start = now();
  if (progress) progress("write", 0);
  WriteSettings writing;
  writing.half = flags.half;
  writing.dilate = flags.dilate;
  std::vector<std::string> keep = flags.keep;
  if (flags.wants("density")) keep.push_back(medium.density.name);
  const Metadata metadata = settingsOf(flags, medium, scene.medium, result);
  const WriteReport written = writeVdb(flags.output, medium.density,
                                       outputGrids(flags, medium, metadata, result), writing, &file, keep);
  result.warnings.insert(result.warnings.end(), written.warnings.begin(), written.warnings.end());
  stats.write = now() - write_start;
  stats.total = now() - start;
  if (!flags.stats.empty()) writeStats(flags.stats, stats, result);

  for (const std::string& warning : result.warnings)
    std::cerr << "vdb_diffuse bake: warning: " << warning << "\n";
  if (!flags.progress.quiet)
    std::cout << flags.output << ": " << stats.active_voxels << " voxels, " << result.iterations
              << " iterations, residual " << result.relative_residual << ", energy closes to "
              << std::abs(result.energy.closure()) << ", " << stats.total << " s\n";
  if (!result.converged) {
    std::cerr << "vdb_diffuse bake: " << flags.input << ": the solve stopped after " << result.iterations
              << " iterations at a residual of " << result.relative_residual << ", above the tolerance "
              << flags.tolerance << "; the output is written and says so\n";
    status = ExitStatus::kNotConverged;
  }
}

}  // namespace

void addBake(CLI::App& program, ExitStatus& status) {
  CLI::App* command =
      program.add_subcommand("bake", "First scatter and diffusion: lighting grids for a volume");
  const auto flags = std::make_shared<BakeFlags>();
  command->add_option("IN.vdb", flags->input, "Volume with a density grid")->required();
  command->add_option("-o,--output", flags->output, "VDB file to write")->required();
  flags->scene.addTo(*command);
  const std::string method = "Method", output = "Output";
  command->add_option("--method", flags->method, "multigrid")
      ->check(CLI::IsMember({"multigrid"}))
      ->group(method)
      ->capture_default_str();
  command
      ->add_option(
          "--model", flags->model,
          "default: P1 with staircase area factor, mean-free-path cap and delta-Eddington; p1: none of "
          "them; paper: as Stam (1995) prints it")
      ->check(CLI::IsMember({"default", "p1", "paper"}))
      ->group(method)
      ->capture_default_str();
  command
      ->add_option(
          "--mean-free-path-cap", flags->cap,
          "Longest path that light takes between scatterings, world units; auto: 0.5 times the cube root of "
          "the active volume with the default model, else none")
      ->type_name("L|auto|none")
      ->group(method)
      ->capture_default_str();
  command
      ->add_option("--sweeps", flags->sweeps,
                   "Transport sweeps after the diffusion solve: each buys a smaller error for more time")
      ->check(CLI::Range(0, 100))
      ->group(method)
      ->capture_default_str();
  command->add_option("--tolerance", flags->tolerance, "Of the solve, on the scaled residual")
      ->group(method)
      ->capture_default_str();
  command->add_option("--threads", flags->threads, "At most this many; default all")->group(method);
  command
      ->add_flag("--exact-shadows", flags->exact_shadows,
                 "March from every voxel to every light, slowly, instead of sweeping along each direction")
      ->group(method);
  command
      ->add_flag("--clamp", flags->clamp,
                 "Take densities that are not finite or negative as 0, not as an error")
      ->group(method);
  command->add_option("--grids", flags->grids, "Of density,diffuse,direct,flux,source")
      ->delimiter(',')
      ->type_name("NAME,...")
      ->group(output)
      ->default_str("density,diffuse,direct");
  command->add_option("--keep", flags->keep, "Other grids of the input to pass through, or all")
      ->delimiter(',')
      ->type_name("NAME,...")
      ->group(output);
  command->add_flag("--half", flags->half, "Lighting grids in 16-bit floats")->group(output);
  command->add_option("--dilate", flags->dilate, "Widen the lighting grids by so many voxels, 0 to 32")
      ->check(CLI::Range(0, 32))
      ->group(output);
  command->add_option("--stats", flags->stats, "JSON file with times, memory, residual and energy")
      ->type_name("FILE.json")
      ->group(output);
  addProgressFlags(command, flags->progress);
  setExample(command,
             "vdb_diffuse bake cloud.vdb -o lit.vdb --sun 1,0.5,-1 --sun-irradiance 3 --env 0.3 --g 0.6");
  command->callback([flags, &status] { run(*flags, status); });
}

}  // namespace vdb_diffuse
