#pragma once

#include "blobs/blob.h"
#include "blobs/cells.h"
#include "grid/progress.h"

namespace vdb_diffuse {

struct FitSettings {
  int count = 200;      ///< of blobs; there are fewer where cells are, or where they would be too close
  int iterations = 10;  ///< of expectation and maximisation
  double overlap = 1;   ///< factor on the fitted sizes
  Progress progress;
};

/// Centres are nowhere nearer to each other than this many of the mean of the two sigmas: blobs that nearly
/// coincide make the system nearly singular.
constexpr double kClosestBlobs = 0.5;

/// Fits a sum of Gaussians to the density by maximum likelihood: a mixture, by expectation and maximisation
/// (Dempster, Laird and Rubin 1977), which keeps the total mass. It starts from a division of the volume: the
/// part with the largest sum of m r^2 is halved across its longest axis until there are enough, so that dense
/// and intricate places get more and smaller blobs.
std::vector<Blob> fitBlobs(const Cells& cells, const FitSettings& settings);

/// By block, the blobs that reach into it.
std::vector<std::vector<int32_t>> blobsByBlock(const std::vector<Blob>& blobs, const Cells& cells);

/// The blob whose centre is nearest in sigmas.
int32_t nearestBlob(const std::vector<Blob>& blobs, const Vec3d& p_frame);

}  // namespace vdb_diffuse
