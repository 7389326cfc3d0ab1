#pragma once

#include "grid/error.h"
#include "lighting_run.h"
#include "stats.h"

namespace vdb_diffuse {

/// What a bake is told: a volume, its light, how to solve, what to write. One volume, or with the same words
/// one per frame (bake_frames.cpp) or per regression test (check.cpp).
struct BakeFlags : LightingFlags {
  std::string method = "multigrid", model = "default", cap = "auto", coarsen = "0";
  double tolerance = 1e-4;
  std::optional<int> sweeps;
  std::optional<double> error;
  bool exact_shadows = false, light_groups = false;
  std::optional<int> blobs;
  std::optional<std::string> blob_form, blob_source;

  bool byBlobs() const { return method == "blobs"; }
  void addMethodTo(CLI::App& command);
};

/// A volume with the light found in it.
struct Baked {
  VdbFile file;
  MediumSettings words;  ///< what was said about the medium
  Medium medium;
  DiffuseResult result;
  std::vector<std::pair<std::string, DiffuseResult>> groups;  ///< what each gives to it; only if wanted
  BakeStats stats;
};

/// Reads the volume and lights it. \throws UsageError, InputError, Interrupted
Baked lightVolume(const BakeFlags& flags, const SceneFile& scene, const Progress& progress);

/// The grids that the flags want, moved out of the result.
std::vector<OutputGrid> outputGrids(const BakeFlags& flags, Baked& baked);

/// One frame from end to end: reads volume and scene, lights it, writes the grids and the statistics, and
/// says so. \param json_fields   see makeProgress \return kDone, or kNotConverged; errors are thrown
ExitStatus bakeFrame(const BakeFlags& flags, const std::string& json_fields = "");

}  // namespace vdb_diffuse
