#include "bake.h"

#include <cmath>
#include <iostream>
#include <sstream>

#include "blobs/blob_light.h"
#include "io/free_memory.h"
#include "medium/coarse_medium.h"
#include "transport/illuminate.h"
#include "transport/tints.h"

namespace vdb_diffuse {
namespace {

constexpr int kMostSweeps = 16;  // of a bake that sweeps until its error is small enough

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

/// Flags of the one method that mean nothing to the other.
void checkMethod(const BakeFlags& flags) {
  const auto refuse = [&](bool given, const std::string& flag, const std::string& why) {
    if (given) throw UsageError(flag + ": has no meaning with --method " + flags.method + why);
  };
  if (!flags.byBlobs()) {
    for (const auto& [given, flag] : {std::pair(flags.blobs.has_value(), "--blobs"),
                                      std::pair(flags.blob_form.has_value(), "--blob-form"),
                                      std::pair(flags.blob_source.has_value(), "--blob-source")})
      refuse(given, flag, "; add --method blobs");
    return;
  }
  refuse(flags.sweeps.value_or(0) > 0, "--sweeps", ", whose light is too coarse to sweep from; leave it out");
  refuse(flags.light_groups, "--light-groups", "; leave it out");
  refuse(flags.error.has_value(), "--error", ", which cannot reach an error by itself; leave it out");
  if (flags.blob_form.value_or("") == "collocation" && flags.blobs.value_or(0) > kMostCollocated)
    throw UsageError("--blob-form collocation: takes at most " + std::to_string(kMostCollocated) +
                     " blobs; use galerkin for more");
}

BlobSettings blobsOf(const BakeFlags& flags) {
  BlobSettings settings;
  settings.count = flags.blobs.value_or(settings.count);
  if (flags.blob_form == "collocation") settings.form = BlobForm::kCollocation;
  settings.source_at_centres = flags.blob_source == "centres";
  settings.want_direct = flags.wants("direct") || flags.wants("source");
  return settings;
}

Metadata settingsOf(const BakeFlags& flags, const Medium& medium, const MediumSettings& words,
                    const DiffuseResult& result) {
  Metadata m = flags.metadataOf(medium, words);
  m["model"] = flags.model;
  m["method"] = flags.method;
  m["mean_free_path_cap"] = result.mean_free_path_cap;
  m["coarsen"] = flags.coarsen;
  m["tolerance"] = flags.tolerance;
  m["iterations"] = result.iterations;
  m["relative_residual"] = result.relative_residual;
  m["converged"] = result.converged ? 1 : 0;
  m["sweeps"] = result.sweeps;
  if (result.estimated_error) m["estimated_error"] = *result.estimated_error;
  return m;
}

std::string errorOf(const DiffuseResult& result) {
  if (!result.estimated_error) return "";
  char text[80];
  std::snprintf(text, sizeof text, ", estimated error %.2g %% after %d sweep%s",
                100 * *result.estimated_error, result.sweeps, result.sweeps == 1 ? "" : "s");
  return text;
}

std::string errorNotReached(const DiffuseResult& result, double wanted) {
  char line[160];
  std::snprintf(
      line, sizeof line,
      "the estimated error is %.2g after %d sweeps, above --error %.2g: finer voxels may help, more "
      "sweeps will not",
      *result.estimated_error, result.sweeps, wanted);
  return line;
}

/// What each step took, for --log info.
void logSteps(const Log& log, const Baked& baked) {
  const auto step = [&](const std::string& name, double seconds, const std::string& what) {
    char text[40];
    std::snprintf(text, sizeof text, "%.3f s", seconds);
    log.info(name + ": " + text + (what.empty() ? "" : ", " + what));
  };
  const DiffuseResult& result = baked.result;
  step("read", baked.stats.read,
       baked.file.path() + ": grid " + baked.medium.density.name + ", " +
           std::to_string(baked.stats.active_voxels) + " active voxels");
  step("source", result.seconds_source, "");
  step("setup", result.seconds_setup, std::to_string(result.levels) + " levels");
  step("solve", result.seconds_solve, std::to_string(result.iterations) + " iterations");
  step("sweeps", result.seconds_sweeps, std::to_string(result.sweeps));
  step("write", baked.stats.write, "");
}

/// All light together; where --light-groups asks for it, that of each group is kept too.
DiffuseResult lightByGroups(const BakeFlags& flags, const Medium& medium, const Scene& scene,
                            const DiffuseSettings& settings, const TransportSettings& transport,
                            std::vector<std::pair<std::string, DiffuseResult>>& kept) {
  std::vector<LightGroup> groups;
  if (flags.light_groups) groups = groupLights(scene, !medium.emission.empty());
  if (groups.empty()) return illuminate(medium, scene, settings, transport);
  std::vector<DiffuseResult> results = illuminate(medium, scene.surfaces, groups, settings, transport);
  DiffuseResult sum = results.front();
  for (size_t g = 1; g < results.size(); ++g) add(results[g], sum);
  warnOfDarkness(medium, sum);
  for (size_t g = 0; g < groups.size(); ++g) kept.emplace_back(groups[g].name, std::move(results[g]));
  return sum;
}

/// The lighting that --grids asks for, moved out of a result.
/// \param suffix   of the grids' names
void addOutputGrids(const BakeFlags& flags, const std::string& suffix, const Metadata& metadata,
                    DiffuseResult& result, std::vector<OutputGrid>& grids) {
  if (flags.wants("diffuse"))
    grids.push_back({"diffuse" + suffix, "W/m^2/sr", std::move(result.diffuse), metadata});
  if (flags.wants("direct"))
    grids.push_back({"direct" + suffix, "W/m^2/sr", std::move(result.direct), metadata});
  if (!flags.wants("flux")) return;
  Channels components;
  for (Field<float>& component : result.flux) components.push_back(std::move(component));
  grids.push_back({"flux" + suffix, "W/m^2", std::move(components), metadata});
}

}  // namespace

void checkFlags(const BakeFlags& flags) {
  const ModelSettings model = modelOf(flags);
  if (!(flags.tolerance > 0 && flags.tolerance < 1))
    throw UsageError("--tolerance: a number between 0 and 1 is needed");
  if (flags.error && !(*flags.error > 0 && *flags.error < 1))
    throw UsageError("--error: a number between 0 and 1 is needed; 0.05 is 5 %");
  checkMethod(flags);
  if (model.model == Model::kPaper && (flags.sweeps.value_or(0) > 0 || flags.error))
    throw UsageError(
        "--model paper: the printed equations lose energy, and no sweep can start from them; use "
        "--model default or p1");
}

double bakeBytes(const BakeFlags& flags, const Medium& medium) {
  const bool flux = flags.wants("flux"), sweeps = sweepsOf(flags) > 0;
  const bool anisotropic = medium.optics.g != 0;
  const double per_channel =
      2 + (medium.optics.g > 0 ? 1 : 0) + (anisotropic || flux ? 3 : 0) + (flux ? 3 : 0);
  constexpr double kSolve =
      13;  // r, p, q, z, w, b, x in double, operator of the finest level and the coarse ones
  constexpr double kSweep = 16;    // depth, source and its slopes, mean, divergence, correction and its solve
  constexpr double kMoments = 25;  // of source, light and beams
  const double fields = 1 + medium.emission.size() + 3 * per_channel + (flux ? 6 : 0) + kSolve +
                        (sweeps ? kSweep + (anisotropic ? kMoments : 0) : 0);
  return fields * sizeof(float) * kBlockVoxels * medium.topology().blockCount();
}

constexpr int kMostCoarsening = 4;

int coarsenToFit(const BakeFlags& flags, Medium& medium) {
  const bool fit = flags.coarsen == "auto";
  const int wanted = fit ? 0 : std::stoi(flags.coarsen);
  int times = 0;
  double need = 0, free = 0;
  while (true) {
    need = bakeBytes(flags, medium);
    free = static_cast<double>(freeMemory());
    if (times >= wanted && (need <= free || !fit || times == kMostCoarsening)) break;
    medium = coarsened(medium);
    ++times;
  }
  if (need <= free) return times;
  constexpr double kGiB = 1024.0 * 1024 * 1024;
  char line[200];
  std::snprintf(line, sizeof line, ": baking it may take %.1f GiB and %.1f GiB are free; %s", need / kGiB,
                free / kGiB, fit ? "clip it" : "--coarsen auto solves it in larger voxels");
  throw InputError(flags.input + line);
}

int sweepsOf(const BakeFlags& flags) {
  if (flags.byBlobs()) return 0;
  return flags.sweeps.value_or(flags.error                               ? kMostSweeps
                               : modelOf(flags).model == Model::kDefault ? TransportSettings().sweeps
                                                                         : 0);
}

Baked lightVolume(const BakeFlags& flags, const SceneFile& scene, const Progress& progress) {
  const double start = now();
  const ModelSettings model = modelOf(flags);
  checkFlags(flags);
  if (progress) progress("read", 0);
  Baked baked{VdbFile(flags.input), scene.medium, {}, {}, {}, {}};
  Medium& medium = baked.medium;
  BakeStats& stats = baked.stats;
  medium = flags.readMedium(baked.file, scene.medium);
  stats.threads = flags.threadCount();

  DiffuseSettings settings;
  settings.model = model;
  settings.tolerance = flags.tolerance;
  settings.source.exact_march = flags.exact_shadows;
  settings.want_flux = flags.wants("flux");
  settings.progress = progress;
  TransportSettings transport;
  transport.sweeps = sweepsOf(flags);
  transport.error = flags.error;
  const int coarser = coarsenToFit(flags, medium);
  stats.active_voxels = medium.topology().activeVoxelCount();
  stats.voxel_size = medium.transform().meanVoxelSize();
  stats.read = now() - start;
  DiffuseResult& result = baked.result;
  try {
    if (flags.byBlobs())
      result = blobLight(medium, scene.scene, settings, blobsOf(flags), &stats.blobs);
    else
      result = lightByGroups(flags, medium, scene.scene, settings, transport, baked.groups);
  } catch (const InputError& error) {  // which knows no files
    throw InputError(flags.input + ": " + error.what());
  }
  if (flags.error && result.estimated_error && *result.estimated_error > *flags.error)
    result.warnings.push_back(errorNotReached(result, *flags.error));
  if (coarser > 0 && flags.coarsen == "auto")
    result.warnings.push_back("the volume does not fit in memory: solved in voxels of " +
                              std::to_string(1 << coarser) + " times the width");
  if (stats.active_voxels == 0) result.warnings.push_back("the density has no active voxels");
  return baked;
}

std::vector<OutputGrid> outputGrids(const BakeFlags& flags, Baked& baked) {
  DiffuseResult& result = baked.result;
  const Metadata metadata = settingsOf(flags, baked.medium, baked.words, result);
  std::vector<OutputGrid> grids;
  Channels source;
  if (flags.wants("source")) source = sourceField(baked.medium, result.direct);
  addOutputGrids(flags, "", metadata, result, grids);
  if (flags.wants("source"))
    grids.push_back({"source", "W/m^2/sr per unit length", std::move(source), metadata});
  for (auto& [name, light] : baked.groups) {
    Metadata of_group = metadata;
    of_group["light_group"] = name;
    addOutputGrids(flags, "_" + name, of_group, light, grids);
  }
  return grids;
}

ExitStatus bakeFrame(const BakeFlags& flags, const std::string& json_fields) {
  const double start = now();
  checkFlags(flags);
  flags.check();
  const SceneFile scene = flags.scene.resolve();
  Progress progress = makeProgress(flags.progress, json_fields);
  Baked baked = lightVolume(flags, scene, progress);
  DiffuseResult& result = baked.result;
  BakeStats& stats = baked.stats;

  const double write_start = now();
  if (progress) progress("write", 0);
  const WriteReport written = flags.write(baked.file, baked.words, baked.medium, outputGrids(flags, baked));
  result.warnings.insert(result.warnings.end(), written.warnings.begin(), written.warnings.end());
  stats.write = now() - write_start;
  stats.total = now() - start;
  if (!flags.stats.empty()) writeStats(flags.stats, stats, result);
  progress = {};  // the bar goes, and lines of text may come

  const Log log = flags.progress.logOf("bake");
  logSteps(log, baked);
  for (const std::string& warning : result.warnings) log.warning(warning);
  if (!flags.progress.quiet)
    std::cout << flags.output << ": " << stats.active_voxels << " voxels, " << result.iterations
              << " iterations, residual " << result.relative_residual << ", energy closes to "
              << std::abs(result.energy.closure()) << errorOf(result) << ", " << stats.total << " s\n";
  if (result.converged) return ExitStatus::kDone;
  std::ostringstream line;
  line << flags.input << ": the solve stopped after " << result.iterations << " iterations at a residual of "
       << result.relative_residual << ", above the tolerance " << flags.tolerance
       << "; the output is written and says so";
  log.error(line.str());
  return ExitStatus::kNotConverged;
}

void BakeFlags::addMethodTo(CLI::App& command) {
  const std::string group = "Method";
  command
      .add_option("--method", method,
                  "multigrid: a value in every voxel; blobs: a few hundred Gaussians, a preview")
      ->check(CLI::IsMember({"multigrid", "blobs"}))
      ->group(group)
      ->capture_default_str();
  command.add_option("--blobs", blobs, "How many blobs are fitted to the density (default: 200)")
      ->type_name("N")
      ->check(CLI::Range(1, kMostBlobs))
      ->group(group);
  command
      .add_option("--blob-form", blob_form,
                  "galerkin: the equation in the mean over each blob; collocation: at their centres, as "
                  "Stam (1995) has it (default: galerkin)")
      ->check(CLI::IsMember({"galerkin", "collocation"}))
      ->group(group);
  command
      .add_option("--blob-source", blob_source,
                  "Where the blobs look for light: in all voxels, or at their centres, as the paper has it, "
                  "which is far quicker unless `direct` is written too (default: voxels)")
      ->check(CLI::IsMember({"voxels", "centres"}))
      ->group(group);
  command
      .add_option("--model", model,
                  "default: P1 with returned light, staircase area factor, mean-free-path cap and "
                  "delta-Eddington; p1: none of "
                  "them; paper: as Stam (1995) prints it")
      ->check(CLI::IsMember({"default", "p1", "paper"}))
      ->group(group)
      ->capture_default_str();
  command
      .add_option(
          "--mean-free-path-cap", cap,
          "Longest path that light takes between scatterings, world units; auto: 0.5 times the cube root of "
          "the active volume with the default model, else none")
      ->type_name("L|auto|none")
      ->group(group)
      ->capture_default_str();
  command
      .add_option("--sweeps", sweeps,
                  "Transport sweeps after the diffusion solve: each buys a smaller error for more time; 0 is "
                  "diffusion alone (default: 2; with --error at most 16; 0 for other models)")
      ->type_name("K")
      ->check(CLI::Range(0, 100))
      ->group(group);
  command
      .add_option("--error", error,
                  "Sweep until the estimated error is at most this: 0.05 is 5 %, RMS on blocks of 4^3 voxels")
      ->type_name("V")
      ->group(group);
  command.add_option("--tolerance", tolerance, "Of the solve, on the scaled residual")
      ->group(group)
      ->capture_default_str();
  command
      .add_option("--coarsen", coarsen,
                  "Solve in voxels of 2^N times the width, 0 to 4; auto: the finest that memory holds")
      ->type_name("N|auto")
      ->check(CLI::IsMember({"0", "1", "2", "3", "4", "auto"}))
      ->group(group)
      ->capture_default_str();
  command
      .add_flag(
          "--light-groups", light_groups,
          "Write diffuse_NAME and direct_NAME too, for every light or `group` of lights of the scene file")
      ->group("Output");
  command
      .add_flag("--exact-shadows", exact_shadows,
                "March from every voxel to every light, slowly, instead of sweeping along each direction")
      ->group(group);
}

}  // namespace vdb_diffuse
