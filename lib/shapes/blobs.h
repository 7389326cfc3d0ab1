#pragma once

#include <cstdint>
#include <vector>

#include "shapes/sizing.h"

namespace vdb_diffuse {

/// One Gaussian: peak exp(-r^2 / (2 sigma^2)), brought to zero smoothly between 3 and 4.5 sigma.
struct GaussianBlob {
  Vec3d centre;  ///< world units, at the shape's own width
  double sigma;  ///< world units, likewise
  double peak;   ///< density at the centre
};

struct BlobsSettings {
  ShapeSize size;
  uint64_t seed = 1;
  int count = 24;    ///< 1 .. 10000
  double peak = 10;  ///< highest density that one blob may have, > 0; where blobs overlap, they add up
};

/// The blobs of these settings, scattered over about `kShapeWidth`.
std::vector<GaussianBlob> gaussianBlobs(const BlobsSettings& settings);

/// Density of one blob at a distance r >= 0 from its centre.
double blobDensity(const GaussianBlob& blob, double r);

/// The sum of the blobs, active where it is not zero. Throws as `requireFeasible` does.
Volume makeBlobs(const BlobsSettings& settings);

}  // namespace vdb_diffuse
