#pragma once

#include <tbb/global_control.h>

#include <memory>
#include <string>
#include <vector>

#include "io/vdb_writer.h"
#include "medium/medium.h"
#include "progress_bar.h"
#include "scene_options.h"

namespace vdb_diffuse {

/// What `bake` and `reference` have in common: a volume comes in with light and optics, lighting grids of
/// the same voxels go out.
struct LightingFlags {
  std::string input, output, stats;
  std::vector<std::string> more_inputs;  ///< lit with the first as one medium
  SceneOptions scene;
  ProgressFlags progress;
  int threads = 0, dilate = 0;
  std::vector<std::string> grids, keep;
  bool half = false, clamp = false;

  std::vector<std::string> inputs() const;
  bool wants(const std::string& grid) const;

  /// IN.vdb, -o and the scene's flags; then the command's own; then
  /// addOutputTo.
  void addInputTo(CLI::App& command);
  /// How the volume is read.
  void addVolumeTo(CLI::App& command);
  /// \param all_grids   comma-separated, what --grids chooses from
  /// \param defaults    likewise, what it chooses unless given
  void addOutputTo(CLI::App& command, const std::string& all_grids, const std::string& defaults,
                   const std::string& stats_help);

  /// Flags that contradict each other or name what there is not, and outputs that could not be written.
  /// \throws UsageError, OutputError
  void check() const;

  /// An output that would take the place of a file the scene was read from. \throws UsageError
  void refuseToReplace(const SceneFile& scene) const;

  /// Null, or what keeps the work to --threads while it lives.
  std::unique_ptr<tbb::global_control> limitThreads() const;
  int threadCount() const;

  /// \param file   the first input; the others are opened here
  /// \param warnings   added to
  Medium readMedium(const VdbFile& file, const MediumSettings& words,
                    std::vector<std::string>& warnings) const;

  /// The version and the medium, for the grids of an output.
  Metadata metadataOf(const Medium& medium, const MediumSettings& words) const;

  /// The density, and with it the albedo grid, is passed through from `file`, or is the medium's where that
  /// is another.
  WriteReport write(const VdbFile& file, const MediumSettings& words, const Medium& medium,
                    std::vector<OutputGrid> lighting) const;

 private:
  std::vector<std::string> all_grids_;
};

/// Seconds of a clock that never goes back.
double now();

}  // namespace vdb_diffuse
