#include "lighting_run.h"

#include <tbb/info.h>

#include <algorithm>
#include <chrono>
#include <locale>
#include <sstream>

#include "grid/error.h"
#include "grid/spelling.h"
#include "io/atomic_file.h"
#include "medium_reader.h"

namespace vdb_diffuse {
namespace {

std::vector<std::string> namesIn(const std::string& list) {
  std::vector<std::string> names;
  for (size_t from = 0; from <= list.size();) {
    const size_t end = std::min(list.find(',', from), list.size());
    names.push_back(list.substr(from, end - from));
    from = end + 1;
  }
  return names;
}

std::string listOf(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ",") + name;
  return list;
}

std::string textOf(const WorldBox& box) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << box.low[0] << ',' << box.low[1] << ',' << box.low[2] << ',' << box.high[0] << ',' << box.high[1]
       << ',' << box.high[2];
  return text.str();
}

}  // namespace

std::vector<std::string> LightingFlags::inputs() const {
  std::vector<std::string> paths{input};
  paths.insert(paths.end(), more_inputs.begin(), more_inputs.end());
  return paths;
}

bool LightingFlags::wants(const std::string& grid) const {
  return std::find(grids.begin(), grids.end(), grid) != grids.end();
}

void LightingFlags::addInputTo(CLI::App& command) {
  command.add_option("IN.vdb", input, "Volume with a density grid")->required();
  command.add_option("MORE.vdb", more_inputs,
                     "Further volumes, lit with the first as one medium: densities add. Voxel size and "
                     "rotation are the same, and whole voxels lie between them");
  command.add_option("-o,--output", output, "VDB file to write")->required();
  addVolumeTo(command);
  scene.addTo(command);
}

void LightingFlags::addVolumeTo(CLI::App& command) {
  command.add_flag("--clamp", clamp, "Take densities that are not finite or negative as 0, not as an error")
      ->group("Volume");
}

void LightingFlags::addOutputTo(CLI::App& command, const std::string& all_grids, const std::string& defaults,
                                const std::string& stats_help) {
  const std::string method = "Method", group = "Output";
  all_grids_ = namesIn(all_grids);
  grids = namesIn(defaults);
  command.add_option("--threads", threads, "At most this many; default all")->group(method);
  command.add_option("--grids", grids, "Of " + all_grids)
      ->delimiter(',')
      ->type_name("NAME,...")
      ->group(group)
      ->default_str(defaults);
  command.add_option("--keep", keep, "Other grids of the input to pass through, or all")
      ->delimiter(',')
      ->type_name("NAME,...")
      ->group(group);
  command.add_flag("--half", half, "Lighting grids in 16-bit floats")->group(group);
  command.add_option("--dilate", dilate, "Widen the lighting grids by so many voxels, 0 to 32")
      ->check(CLI::Range(0, 32))
      ->group(group);
  command.add_option("--stats", stats, stats_help)->type_name("FILE.json")->group(group);
  addProgressFlags(&command, progress);
}

void LightingFlags::check() const {
  for (const std::string& grid : grids) {
    if (std::find(all_grids_.begin(), all_grids_.end(), grid) != all_grids_.end()) continue;
    const std::string nearest = nearestSpelling(grid, all_grids_);
    throw UsageError(
        "--grids: there is no '" + grid + "'" +
        (nearest.empty() ? "; choose from " + listOf(all_grids_) : "; did you mean " + nearest + "?"));
  }
  if (threads < 0) throw UsageError("--threads: a number above 0 is needed");
  for (const std::string& path : inputs())
    if (sameFile(path, output)) throw UsageError(output + ": is the input itself; give -o another name");
  for (const std::string& path : inputs())
    if (!stats.empty() && (stats == output || sameFile(stats, path)))
      throw UsageError("--stats: " + stats + " is the input or the output; give it another name");
  for (const std::string& path : {output, stats})
    if (!path.empty()) AtomicFile probe(path);  // a folder one may not write to is found before the work
}

void LightingFlags::refuseToReplace(const SceneFile& scene) const {
  for (const std::string& path : {output, stats})
    for (const std::string& read : scene.files)
      if (sameFile(path, read))
        throw UsageError(path + ": is read as part of the scene (" + read +
                         "); give the output another name");
}

std::unique_ptr<tbb::global_control> LightingFlags::limitThreads() const {
  if (threads <= 0) return nullptr;
  return std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, threads);
}

int LightingFlags::threadCount() const {
  const int all = tbb::info::default_concurrency();
  return threads > 0 ? std::min(threads, all) : all;
}

Medium LightingFlags::readMedium(const VdbFile& file, const MediumSettings& words,
                                 std::vector<std::string>& warnings) const {
  ReadSettings reading;
  reading.clamp = clamp;
  std::vector<VdbFile> others;
  for (const std::string& path : more_inputs) others.emplace_back(path);
  std::vector<const VdbFile*> files{&file};
  for (const VdbFile& other : others) files.push_back(&other);
  return vdb_diffuse::readMedium(files, words, reading, warnings);
}

Metadata LightingFlags::metadataOf(const Medium& medium, const MediumSettings& words) const {
  Metadata m;
  m["generator"] = std::string("vdb_diffuse " VDB_DIFFUSE_VERSION);
  const char* suffix[] = {"_r", "_g", "_b"};
  for (int c = 0; c < 3; ++c) {
    m[std::string("sigma_s") + suffix[c]] = medium.optics.sigma_s[c];
    m[std::string("sigma_a") + suffix[c]] = medium.optics.sigma_a[c];
  }
  m["g"] = medium.optics.g;
  m["emission_scale"] = medium.optics.emission_scale;
  if (words.albedo_grid) m["albedo_grid"] = *words.albedo_grid;
  if (words.emission) m["emission"] = *words.emission;
  if (words.temperature) {
    m["temperature"] = *words.temperature;
    m["temperature_scale"] = words.temperature_scale.value_or(1);
    m["blackbody_intensity"] = words.blackbody_intensity.value_or(1);
  }
  m["density"] = medium.density.name;
  if (words.min_density) m["min_density"] = *words.min_density;
  if (words.crop) m["crop"] = textOf(*words.crop);
  return m;
}

WriteReport LightingFlags::write(const VdbFile& file, const MediumSettings& words, const Medium& medium,
                                 std::vector<OutputGrid> lighting) const {
  WriteSettings writing;
  writing.half = half;
  writing.dilate = dilate;
  std::vector<std::string> kept = keep;
  const bool passed_through = more_inputs.empty() && !cutOf(words).any();
  const auto pass = [&](const std::string& name, const Channels& values) {
    if (passed_through) {
      if (wants("density")) kept.push_back(name);
    } else if (wants("density") || std::find(kept.begin(), kept.end(), name) != kept.end()) {
      kept.erase(std::remove(kept.begin(), kept.end(), name), kept.end());
      OutputGrid grid{name, "", values, {}};
      grid.as_is = true;
      lighting.insert(lighting.begin(), std::move(grid));
    }
  };
  if (words.albedo_grid && *words.albedo_grid != medium.density.name) pass(*words.albedo_grid, medium.albedo);
  pass(medium.density.name, {medium.density.values});
  return writeVdb(output, medium.density, std::move(lighting), writing, &file, kept);
}

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace vdb_diffuse
