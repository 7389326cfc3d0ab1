#include "shapes/blobs.h"

#include <algorithm>
#include <cmath>

#include "shapes/noise.h"
#include "shapes/sparse_fill.h"

namespace vdb_diffuse {
namespace {

constexpr double kFadeFrom = 3, kFadeTo = 4.5;  // sigmas

double reachOf(const GaussianBlob& blob) {
  return kFadeTo * blob.sigma;
}

double densityAt(const std::vector<GaussianBlob>& blobs, const Vec3d& p_world) {
  double sum = 0;
  for (const GaussianBlob& blob : blobs) {
    const double squared = (p_world - blob.centre).lengthSqr();
    if (squared < reachOf(blob) * reachOf(blob)) sum += blobDensity(blob, std::sqrt(squared));
  }
  return sum;
}

Volume filledBlobs(const std::vector<GaussianBlob>& blobs, const WorldBox& box, double h) {
  // The blobs that reach into a box of voxels; a list per thread, so that it is not allocated for each.
  const auto near = [&, h](const Coord& low, const Coord& high) -> const std::vector<GaussianBlob>& {
    thread_local std::vector<GaussianBlob> list;
    list.clear();
    for (const GaussianBlob& blob : blobs) {
      Vec3d nearest = blob.centre;
      for (int a = 0; a < 3; ++a) nearest[a] = std::clamp(nearest[a], low[a] * h, high[a] * h);
      if ((nearest - blob.centre).length() < reachOf(blob)) list.push_back(blob);
    }
    return list;
  };
  Formula formula;
  for (int a = 0; a < 3; ++a) {
    formula.lowest[a] = static_cast<int>(std::floor(box.low[a] / h));
    formula.highest[a] = static_cast<int>(std::ceil(box.high[a] / h));
  }
  formula.may_touch = [&](const Coord& low, const Coord& high) { return !near(low, high).empty(); };
  formula.fill = [&, h](const Coord& origin, float* values, BlockMask& active) {
    const std::vector<GaussianBlob>& blobs_here = near(origin, origin.offsetBy(kBlockWidth - 1));
    for (int n = 0; n < kBlockVoxels; ++n) {
      values[n] = static_cast<float>(densityAt(blobs_here, (origin + voxelLocal(n)).asVec3d() * h));
      if (values[n] > 0) active.setOn(n);
    }
  };
  return sparseFill(formula, h);
}

}  // namespace

double blobDensity(const GaussianBlob& blob, double r) {
  const double u = r / blob.sigma;
  if (u >= kFadeTo) return 0;
  const double t = std::clamp((kFadeTo - u) / (kFadeTo - kFadeFrom), 0.0, 1.0);
  return blob.peak * std::exp(-0.5 * u * u) * t * t * (3 - 2 * t);
}

std::vector<GaussianBlob> gaussianBlobs(const BlobsSettings& settings) {
  // Sizes shrink as the blobs get more, so that they stay blobs.
  const double size = 0.6 * std::cbrt(24.0 / settings.count);
  std::vector<GaussianBlob> blobs;
  uint64_t n = 0;
  const auto draw = [&](double low, double high) {
    return low + (high - low) * uniformRandom(settings.seed, n++);
  };
  for (int i = 0; i < settings.count; ++i) {
    GaussianBlob blob;
    for (int a = 0; a < 3; ++a) blob.centre[a] = draw(-0.36, 0.36) * kShapeWidth;
    blob.sigma = size * draw(0.5, 1.3);
    blob.peak = settings.peak * draw(0.3, 1);
    blobs.push_back(blob);
  }
  return blobs;
}

Volume makeBlobs(const BlobsSettings& settings) {
  constexpr double kLeafFill = 0.3;  // on the low side of what is met
  requireFeasible(settings.size, kLeafFill);
  const std::vector<GaussianBlob> blobs = gaussianBlobs(settings);
  WorldBox box{blobs[0].centre, blobs[0].centre};
  for (const GaussianBlob& blob : blobs) {
    box.low = openvdb::math::minComponent(box.low, blob.centre - Vec3d(reachOf(blob)));
    box.high = openvdb::math::maxComponent(box.high, blob.centre + Vec3d(reachOf(blob)));
  }
  const double volume =
      estimateVolume(box, [&](const Vec3d& p_world) { return densityAt(blobs, p_world) > 0; });
  return fillToSize(
      settings.size, [&](double) { return volume; }, [&](double h) { return filledBlobs(blobs, box, h); });
}

}  // namespace vdb_diffuse
