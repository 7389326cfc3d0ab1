#pragma once

#include <string>

#include "blobs/blob_light.h"

namespace vdb_diffuse {

/// What `bake --stats` writes, beside the result itself. Times are seconds of wall clock.
struct BakeStats {
  size_t active_voxels = 0;
  double voxel_size = 0;  ///< side of the cube of a voxel's volume, world units
  double read = 0, sweeps = 0, write = 0, total = 0;
  int threads = 1;
  BlobReport blobs;  ///< of --method blobs, else zeros
};

/// The largest memory that this process has had resident, in bytes.
size_t peakBytes();

/// Writes the JSON file, whole or not at all. All keys are always present. \throws OutputError
void writeStats(const std::string& path, const BakeStats& stats, const DiffuseResult& result);

}  // namespace vdb_diffuse
