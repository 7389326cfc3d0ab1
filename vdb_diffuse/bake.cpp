#include "bake.h"

#include <cmath>
#include <iostream>
#include <sstream>

#include "blobs/blob_light.h"
#include "transport/illuminate.h"
#include "transport/tints.h"

namespace vdb_diffuse {
namespace {

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

Baked lightVolume(const BakeFlags& flags, const SceneFile& scene, const Progress& progress) {
  const double start = now();
  const ModelSettings model = modelOf(flags);
  checkFlags(flags);
  if (progress) progress("read", 0);
  Baked baked{VdbFile(flags.input), scene.medium, {}, {}, {}, {}};
  Medium& medium = baked.medium;
  BakeStats& stats = baked.stats;
  std::vector<std::string> warnings;
  medium = flags.readMedium(baked.file, scene.medium, warnings);
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
  result.warnings.insert(result.warnings.begin(), warnings.begin(), warnings.end());
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
  flags.refuseToReplace(scene);
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

}  // namespace vdb_diffuse
