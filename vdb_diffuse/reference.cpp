#include "reference/path_tracer.h"

#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "example.h"
#include "grid/error.h"
#include "io/free_memory.h"
#include "io/whole_file.h"
#include "lighting_run.h"
#include "stats.h"
#include "words.h"

namespace vdb_diffuse {
namespace {

struct ReferenceFlags : LightingFlags {
  std::string samples, noise, seconds;
  uint64_t seed = 1;
};

ReferenceSettings settingsOf(const ReferenceFlags& flags) {
  ReferenceSettings settings;
  if (!flags.samples.empty()) {
    const double samples = numberIn("--samples", flags.samples, 1, 1e18);  // "1e6" is a number of paths too
    settings.samples = static_cast<uint64_t>(std::llround(samples));
  }
  if (!flags.noise.empty()) settings.noise = numberIn("--noise", flags.noise);
  if (!flags.seconds.empty()) settings.seconds = numberIn("--seconds", flags.seconds);
  if (!flags.noise.empty() && !(settings.noise > 0)) refuseWord("--noise", flags.noise, "must be above 0");
  if (!flags.seconds.empty() && !(settings.seconds > 0))
    refuseWord("--seconds", flags.seconds, "must be above 0");
  settings.seed = flags.seed;
  settings.want_flux = flags.wants("flux");
  return settings;
}

std::vector<OutputGrid> outputGrids(const ReferenceFlags& flags, const Metadata& metadata,
                                    ReferenceResult& result) {
  std::vector<OutputGrid> grids;
  const auto add = [&](const std::string& name, const std::string& unit, Channels& channels) {
    if (flags.wants(name)) grids.push_back({name, unit, std::move(channels), metadata});
  };
  add("diffuse", "W/m^2/sr", result.diffuse);
  add("direct", "W/m^2/sr", result.direct);
  add("diffuse_se", "W/m^2/sr", result.diffuse_se);
  Channels flux;
  if (flags.wants("flux"))
    for (Field<float>& component : result.flux) flux.push_back(std::move(component));
  add("flux", "W/m^2", flux);
  return grids;
}

struct Times {
  double read = 0, write = 0, total = 0;
};

void writeReferenceStats(const ReferenceFlags& flags, const Medium& medium, const ReferenceResult& result,
                         const Times& times) {
  const size_t peak = peakBytes(), voxels = medium.topology().activeVoxelCount();
  const ReferenceEnergy& energy = result.energy;
  const nlohmann::ordered_json json = {
      {"version", VDB_DIFFUSE_VERSION},
      {"active_voxels", voxels},
      {"voxel_size", medium.transform().meanVoxelSize()},
      {"seconds",
       {{"read", times.read}, {"paths", result.seconds}, {"write", times.write}, {"total", times.total}}},
      {"peak_bytes", peak},
      {"bytes_per_voxel", voxels ? static_cast<double>(peak) / voxels : 0.0},
      {"samples", result.samples},
      {"scatterings", result.scatterings},
      {"batches", result.batches},
      {"noise", result.noise},
      {"correlation",
       {{"2", result.correlation[0]}, {"4", result.correlation[1]}, {"8", result.correlation[2]}}},
      {"seed", flags.seed},
      {"energy",
       {{"scattered_in", energy.scattered_in},
        {"emitted", energy.emitted},
        {"absorbed", energy.absorbed},
        {"escaped", energy.escaped},
        {"lost", energy.lost},
        {"closure", energy.closure()}}},
      {"threads", flags.threadCount()},
      {"warnings", result.warnings}};
  writeWholeFile(flags.stats, json.dump(2) + "\n");
}

void run(const ReferenceFlags& flags) {
  Times times;
  const double start = now();
  ReferenceSettings settings = settingsOf(flags);
  flags.check();
  const SceneFile scene = flags.scene.resolve();
  flags.refuseToReplace(scene);
  const auto limit = flags.limitThreads();
  settings.progress = makeProgress(flags.progress);
  if (settings.progress) settings.progress("read", 0);
  const VdbFile file(flags.input);
  std::vector<std::string> warnings;
  const Medium medium = flags.readMedium(file, scene.medium, warnings);
  times.read = now() - start;

  settings.max_bytes = freeMemory();
  ReferenceResult result;
  try {
    result = reference(medium, scene.scene, settings);
  } catch (const InputError& error) {
    throw InputError(flags.input + ": " + error.what());
  }

  result.warnings.insert(result.warnings.begin(), warnings.begin(), warnings.end());

  const double write_start = now();
  if (settings.progress) settings.progress("write", 0);
  Metadata metadata = flags.metadataOf(medium, scene.medium);
  metadata["method"] = std::string("reference");
  metadata["samples"] = static_cast<double>(result.samples);
  metadata["noise"] = result.noise;
  for (int n = 0; n < 3; ++n)  // which `compare --block` takes into account
    metadata["correlation_" + std::to_string(2 << n)] = result.correlation[n];
  metadata["seed"] = std::to_string(flags.seed);
  const WriteReport written = flags.write(file, scene.medium, medium, outputGrids(flags, metadata, result));
  result.warnings.insert(result.warnings.end(), written.warnings.begin(), written.warnings.end());
  times.write = now() - write_start;
  times.total = now() - start;
  if (!flags.stats.empty()) writeReferenceStats(flags, medium, result, times);

  for (const std::string& warning : result.warnings) flags.progress.logOf("reference").warning(warning);
  if (!flags.progress.quiet)
    std::cout << flags.output << ": " << medium.topology().activeVoxelCount() << " voxels, " << result.samples
              << " paths, noise " << 100 * result.noise << " % per voxel, " << times.total << " s\n";
}

}  // namespace

void addReference(CLI::App& program, ExitStatus&) {
  CLI::App* command =
      program.add_subcommand("reference", "The same lighting grids by Monte Carlo, with standard errors");
  const auto flags = std::make_shared<ReferenceFlags>();
  flags->addInputTo(*command);
  const std::string method = "Method (the first limit that is met ends it; default: --noise 0.02)";
  addWord(*command, method, "--noise", flags->noise, "V",
          "Stop at this relative noise per voxel: sqrt(sum se^2 / sum diffuse^2); 0.02 is 2 %");
  addWord(*command, method, "--samples", flags->samples, "N", "Stop after so many paths");
  addWord(*command, method, "--seconds", flags->seconds, "V", "Stop after this time");
  command->add_option("--seed", flags->seed, "Of the random numbers: another one, another noise")
      ->group(method)
      ->capture_default_str();
  flags->addOutputTo(*command, "density,diffuse,direct,flux,diffuse_se", "density,diffuse,direct,diffuse_se",
                     "JSON file with times, memory, noise and energy");
  setExample(command,
             "vdb_diffuse reference cloud.vdb -o reference.vdb --sun 1,0.5,-1 --env 0.3 --noise 0.05");
  command->callback([flags] { run(*flags); });
}

}  // namespace vdb_diffuse
