#include "stats.h"

#include <sys/resource.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "io/whole_file.h"

namespace vdb_diffuse {

size_t peakBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<size_t>(usage.ru_maxrss) * 1024;
}

void writeStats(const std::string& path, const BakeStats& stats, const DiffuseResult& result) {
  const size_t peak = peakBytes();
  const Energy& energy = result.energy;
  const double condition = stats.blobs.condition_number;
  nlohmann::ordered_json json = {
      {"version", VDB_DIFFUSE_VERSION},
      {"active_voxels", stats.active_voxels},
      {"voxel_size", stats.voxel_size},
      {"seconds",
       {{"read", stats.read},
        {"source", result.seconds_source},
        {"fit", stats.blobs.seconds_fit},
        {"setup", result.seconds_setup},
        {"solve", result.seconds_solve},
        {"sweeps", result.seconds_sweeps},
        {"write", stats.write},
        {"total", stats.total}}},
      {"peak_bytes", peak},
      {"bytes_per_voxel", stats.active_voxels ? static_cast<double>(peak) / stats.active_voxels : 0.0},
      {"levels", result.levels},
      {"iterations", result.iterations},
      {"relative_residual", result.relative_residual},
      {"converged", result.converged},
      {"mean_free_path_cap", result.mean_free_path_cap},
      {"energy",
       {{"scattered_in", energy.scattered_in},
        {"emitted", energy.emitted},
        {"absorbed", energy.absorbed},
        {"escaped", energy.escaped},
        {"closure", energy.closure()}}},
      {"sweeps", result.sweeps},
      {"blobs", stats.blobs.blobs},
      {"condition_number",
       std::isfinite(condition) && condition > 0 ? nlohmann::ordered_json(condition) : nullptr},
      {"estimated_error", result.estimated_error ? nlohmann::ordered_json(*result.estimated_error) : nullptr},
      {"negative_voxels", result.negative_voxels},
      {"threads", stats.threads},
      {"warnings", result.warnings}};
  writeWholeFile(path, json.dump(2) + "\n");
}

}  // namespace vdb_diffuse
