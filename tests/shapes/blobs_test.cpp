#include "shapes/blobs.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "shapes/volume_checks.h"

namespace vdb_diffuse {
namespace {

constexpr double kPi = 3.14159265358979323846;

TEST(Blobs, MassIsTheSumOfTheBlobs) {
  BlobsSettings settings;
  settings.size.voxels = 200000;
  settings.count = 7;
  const Volume volume = makeBlobs(settings);
  expectSound(volume);
  EXPECT_NEAR(double(volume.topology->activeVoxelCount()), 200000, 0.03 * 200000);
  double whole = 0, gaussian = 0;
  for (const GaussianBlob& blob : gaussianBlobs(settings)) {
    const double dr = 1e-3 * blob.sigma;
    for (double r = 0.5 * dr; r < 5 * blob.sigma; r += dr)
      whole += 4 * kPi * r * r * dr * blobDensity(blob, r);
    gaussian += blob.peak * std::pow(2 * kPi, 1.5) * std::pow(blob.sigma, 3);
  }
  // Voxel centres integrate so smooth a function far better than their count suggests.
  EXPECT_NEAR(massOf(volume), whole, 1e-4 * whole);
  EXPECT_NEAR(whole, gaussian, 0.029 * gaussian);  // a Gaussian has 2.9 % of its mass beyond 3 sigma
  EXPECT_LT(whole, gaussian);
}

TEST(Blobs, EndWithoutAStep) {
  BlobsSettings settings;
  settings.size.voxels = 400000;
  const Volume volume = makeBlobs(settings);
  float edge = 0;
  forEachActive(volume, [&](const Coord& p, float value) {
    for (int side = 0; side < 6; ++side) {
      Coord next = p;
      next[side / 2] += side % 2 ? 1 : -1;
      if (!volume.topology->isActive(next)) edge = std::max(edge, value);
    }
  });
  EXPECT_GT(edge, 0);
  EXPECT_LT(edge, 1e-4 * settings.peak);
}

TEST(Blobs, DependOnTheSeedAndNotOnTheThreads) {
  BlobsSettings settings;
  settings.size.voxels = 30000;
  const Volume once = makeBlobs(settings);
  {
    tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    expectSame(once, makeBlobs(settings));
  }
  settings.seed = 2;
  EXPECT_FALSE(isSame(once, makeBlobs(settings)));
}

TEST(Blobs, OneBlobAloneIsAPossibleVolume) {
  BlobsSettings settings;
  settings.size.voxels = 600;
  settings.count = 1;
  const Volume volume = makeBlobs(settings);
  expectSound(volume);
  EXPECT_NEAR(double(volume.topology->activeVoxelCount()), 600, 0.05 * 600);
}

}  // namespace
}  // namespace vdb_diffuse
