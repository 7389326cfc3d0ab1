#include "lighting_run.h"

#include <tbb/info.h>

#include <algorithm>
#include <chrono>

#include "grid/error.h"
#include "grid/spelling.h"
#include "io/atomic_file.h"

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

}  // namespace

bool LightingFlags::wants(const std::string& grid) const {
  return std::find(grids.begin(), grids.end(), grid) != grids.end();
}

void LightingFlags::addInputTo(CLI::App& command) {
  command.add_option("IN.vdb", input, "Volume with a density grid")->required();
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
  if (sameFile(input, output)) throw UsageError(output + ": is the input itself; give -o another name");
  if (!stats.empty() && (stats == output || sameFile(stats, input)))
    throw UsageError("--stats: " + stats + " is the input or the output; give it another name");
  for (const std::string& path : {output, stats})
    if (!path.empty()) AtomicFile probe(path);  // a folder one may not write to is found before the work
}

std::unique_ptr<tbb::global_control> LightingFlags::limitThreads() const {
  if (threads <= 0) return nullptr;
  return std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, threads);
}

int LightingFlags::threadCount() const {
  const int all = tbb::info::default_concurrency();
  return threads > 0 ? std::min(threads, all) : all;
}

Medium LightingFlags::readMedium(const VdbFile& file, const MediumSettings& words) const {
  ReadSettings reading;
  reading.clamp = clamp;
  Medium medium;
  medium.density = file.readDensity(words.density.value_or(""), reading);
  file.forget(medium.density.name);  // the bake will want the memory
  medium.optics = opticsOf(words);
  if (words.emission) {
    medium.emission = file.readOnto(*words.emission, medium.density, reading);
    file.forget(*words.emission);
  }
  return medium;
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
  if (words.emission) m["emission"] = *words.emission;
  m["density"] = medium.density.name;
  return m;
}

WriteReport LightingFlags::write(const VdbFile& file, const Medium& medium,
                                 std::vector<OutputGrid> lighting) const {
  WriteSettings writing;
  writing.half = half;
  writing.dilate = dilate;
  std::vector<std::string> kept = keep;
  if (wants("density")) kept.push_back(medium.density.name);
  return writeVdb(output, medium.density, std::move(lighting), writing, &file, kept);
}

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace vdb_diffuse
