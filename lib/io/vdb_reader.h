#pragma once

#include <memory>
#include <string>
#include <vector>

#include "grid/census.h"
#include "grid/convert.h"

namespace vdb_diffuse {

struct ReadSettings {
  uint64_t max_bytes = 0;  ///< a volume may take this much memory; 0: what the machine has free
  bool clamp = false;  ///< values that are not finite, or negative where they may not, become 0 instead of
                       ///< being refused
};

/// What a grid says of itself, without its values having been read.
struct GridSummary {
  std::string name;
  std::string value_type;   ///< float, double, vec3s, bool, int32, ...; points for a PointDataGrid
  std::string grid_class;   ///< "fog volume", "level set", "staggered vector field", "points", "unknown"
  std::string compression;  ///< as stored in the file; empty where the file does not tell
  bool half = false;        ///< values are stored in 16 bits
  bool readable = true;     ///< false for points: their bytes are not checked, so OpenVDB does not get them
};

/// A VDB file opened for reading. Grids are read on demand, whole (no delayed loading), and kept, so that
/// they can be passed through to an output unchanged. Every failure is an InputError that begins with the
/// path.
class VdbFile {
 public:
  /// Opens regular files only, so that it never blocks, and checks the file's bytes before OpenVDB sees it.
  explicit VdbFile(const std::string& path);
  ~VdbFile();
  VdbFile(VdbFile&&) noexcept;
  VdbFile& operator=(VdbFile&&) noexcept;

  const std::string& path() const;
  const std::vector<GridSummary>& grids() const;  ///< in the order of their names
  bool has(const std::string& name) const;
  /// Throws where there is no such grid, naming those there are and, if given, what to do.
  void require(const std::string& name, const std::string& cure = "") const;

  /// The density that `readDensity` would take for `name`; empty asks for "density", else the only float fog
  /// grid.
  std::string densityName(const std::string& name = "") const;
  /// A scalar fog grid with values in 0..1e30. Level sets, points, vectors, integers, transforms that are not
  /// linear with right angles, and volumes that do not fit in memory are refused.
  Volume readDensity(const std::string& name = "", const ReadSettings& settings = {}) const;
  /// A float, double, vec3s or vec3d grid with whatever values it has.
  GridValues readValues(const std::string& name, const ReadSettings& settings = {}) const;
  /// A scalar grid, held to the same range as a density, at the active voxels of `target`: trilinear, or
  /// copied where the voxels are the same.
  Field<float> readOnto(const std::string& name, const Volume& target,
                        const ReadSettings& settings = {}) const;
  /// A float or vec3s grid at the active voxels of `target`, interpolated where its voxels are others; values
  /// of either sign, finite and at most 1e30.
  Channels readChannelsOnto(const std::string& name, const Volume& target,
                            const ReadSettings& settings = {}) const;

  /// A float or vec3s grid of factors at the active voxels of `target`, interpolated between active voxels
  /// where its own are others, and the background where it has none: what a renderer reads there. Values that
  /// are not finite are refused, those outside 0..1 are clamped.
  struct Factors {
    Channels channels;
    std::array<float, 3> background{0, 0, 0};
    uint64_t clamped = 0;  ///< voxels with a value of `target` above zero that were
    uint64_t outside = 0;  ///< likewise, that took the background
  };
  Factors readFactorsOnto(const std::string& name, const Volume& target,
                          const ReadSettings& settings = {}) const;

  Census readCensus(const std::string& name) const;
  /// The grid as OpenVDB reads it.
  std::shared_ptr<const openvdb::GridBase> readGrid(const std::string& name) const;
  /// Lets go of a grid that has been read, to be read again if it is wanted once more. By then the file may
  /// have been replaced or removed, since it is still open; one that was changed in its place is refused.
  void forget(const std::string& name) const;
  /// Copies of the file's own metadata, as text.
  std::vector<std::pair<std::string, std::string>> metadata() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vdb_diffuse
