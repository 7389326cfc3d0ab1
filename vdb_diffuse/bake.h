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

/// Flags that contradict each other or are out of range, before any file is opened. \throws UsageError
void checkFlags(const BakeFlags& flags);

/// \throws UsageError
ModelSettings modelOf(const BakeFlags& flags);
/// The transport sweeps that are asked for, or that are usual.
int sweepsOf(const BakeFlags& flags);

/// What lighting a medium may take, in bytes. Counted in 4-byte fields over the blocks: density, albedo and
/// emission; per channel the light, its vector means, and the results; then one solve.
double bakeBytes(const BakeFlags& flags, const Medium& medium);
/// Halves the medium's resolution as often as --coarsen says, or as memory asks, before anything else is
/// allocated. \return how often \throws InputError where it does not fit
int coarsenToFit(const BakeFlags& flags, Medium& medium);

/// Says on standard output what a bake would read and about how much memory and time it would take, and
/// writes nothing. \throws as the bake would
void dryRun(const BakeFlags& flags);

/// Reads the volume and lights it. \throws UsageError, InputError, Interrupted
Baked lightVolume(const BakeFlags& flags, const SceneFile& scene, const Progress& progress);

/// The grids that the flags want, moved out of the result.
std::vector<OutputGrid> outputGrids(const BakeFlags& flags, Baked& baked);

/// One frame from end to end: reads volume and scene, lights it, writes the grids and the statistics, and
/// says so. \param json_fields   see makeProgress \return kDone, or kNotConverged; errors are thrown
ExitStatus bakeFrame(const BakeFlags& flags, const std::string& json_fields = "");

}  // namespace vdb_diffuse
