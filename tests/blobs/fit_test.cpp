#include "blobs/fit.h"

#include <gtest/gtest.h>

#include <numeric>

#include "volumes.h"

namespace vdb_diffuse {
namespace {

FitSettings count(int n) {
  FitSettings settings;
  settings.count = n;
  return settings;
}

double massOf(const std::vector<Blob>& blobs) {
  return std::accumulate(blobs.begin(), blobs.end(), 0.0, [](double s, const Blob& b) { return s + b.mass; });
}

Medium lumps(uint64_t seed) {
  return boxMedium(
      Coord(40, 40, 40), Transform::uniform(0.5), [=](Coord p) { return lumpyDensity(p, seed); },
      Coord(-7, 3, 11));
}

TEST(Blobs, KernelIntegralIsWhatItSays) {
  double sum = 0;
  constexpr int kSteps = 10000;
  for (int n = 0; n < kSteps; ++n) {
    const double u = (n + 0.5) * kBlobReach / kSteps;
    sum += 4 * M_PI * u * u * blobKernel(u * u).value * kBlobReach / kSteps;
  }
  EXPECT_NEAR(sum, kBlobIntegral, 1e-5 * kBlobIntegral);
}

// Expectation and maximisation keep the mass, whatever the blobs do.
TEST(BlobFit, KeepsTheMass) {
  for (const int n : {1, 7, 60, 400}) {
    const Medium medium = lumps(3);
    const Cells cells = findCells(medium, 30 * static_cast<size_t>(n));
    const double mass = std::accumulate(cells.mass.begin(), cells.mass.end(), 0.0);
    const std::vector<Blob> blobs = fitBlobs(cells, count(n));
    EXPECT_NEAR(massOf(blobs), mass, 1e-6 * mass) << n;
    EXPECT_LE(blobs.size(), static_cast<size_t>(n));
    EXPECT_GE(blobs.size(), static_cast<size_t>(0.9 * n));
  }
}

TEST(BlobFit, FindsBlobsThatAreThere) {
  const Vec3d centres[] = {{12, 14, 12}, {33, 20, 14}, {20, 34, 33}};
  const double sigma = 3, peaks[] = {1, 4, 2};
  const Medium medium = boxMedium(Coord(46, 46, 46), Transform::uniform(1), [&](Coord p) {
    double rho = 0;
    for (int i = 0; i < 3; ++i)
      rho += peaks[i] * std::exp(-0.5 * (p.asVec3d() - centres[i]).lengthSqr() / (sigma * sigma));
    return rho > 0.02 ? rho : -1;
  });
  FitSettings settings = count(3);
  settings.iterations = 30;
  const std::vector<Blob> blobs = fitBlobs(findCells(medium, 2000), settings);
  ASSERT_EQ(blobs.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    const Blob* nearest = &blobs[0];
    for (const Blob& blob : blobs)
      if ((blob.centre - centres[i]).length() < (nearest->centre - centres[i]).length()) nearest = &blob;
    EXPECT_LT((nearest->centre - centres[i]).length(), 0.1 * sigma);
    // Fitted by a kernel that fades, and a tenth of the weights is even: somewhat wider and more alike.
    EXPECT_NEAR(nearest->sigma, sigma, 0.2 * sigma);
    EXPECT_NEAR(nearest->mass / massOf(blobs), peaks[i] / 7, 0.05);
  }
}

TEST(BlobFit, NoTwoAreTooClose) {
  const std::vector<Blob> blobs = fitBlobs(findCells(lumps(5), 9000), count(300));
  for (size_t i = 0; i < blobs.size(); ++i)
    for (size_t j = 0; j < i; ++j)
      EXPECT_GE((blobs[i].centre - blobs[j].centre).length(),
                kClosestBlobs * 0.5 * (blobs[i].sigma + blobs[j].sigma));
}

// An eighth of the box holds two thirds of the mass: without regard to it, it would get an eighth of the
// blobs.
TEST(BlobFit, DensePlacesGetMoreAndSmallerOnes) {
  const auto dense = [](const Vec3d& p) { return p[0] < 16 && p[1] < 16 && p[2] < 16; };
  const Medium medium = boxMedium(Coord(32, 32, 32), Transform::uniform(1),
                                  [&](Coord p) { return dense(p.asVec3d()) ? 14.0 : 1.0; });
  const std::vector<Blob> blobs = fitBlobs(findCells(medium, 6000), count(200));
  double inside = 0, size_inside = 0, size_outside = 0;
  for (const Blob& blob : blobs) {
    inside += dense(blob.centre);
    (dense(blob.centre) ? size_inside : size_outside) += blob.sigma;
  }
  const double outside = static_cast<double>(blobs.size()) - inside;
  EXPECT_GT(inside, 2.0 * static_cast<double>(blobs.size()) / 8);
  EXPECT_LT(size_inside / inside, 0.8 * size_outside / outside);
}

// One voxel, none, a grid far from the origin: no blob is asked for more than there is.
TEST(BlobFit, TakesWhatThereIs) {
  EXPECT_TRUE(fitBlobs(findCells(Medium(), 100), count(10)).empty());
  const auto one = [](Coord) { return 2.0; };
  for (const Coord& offset : {Coord(0, 0, 0), Coord(-1, 7, 8), Coord(1 << 29, -(1 << 29), 5)}) {
    const std::vector<Blob> blobs =
        fitBlobs(findCells(boxMedium(Coord(1, 1, 1), Transform::uniform(3), one, offset), 100), count(10));
    ASSERT_EQ(blobs.size(), 1u);
    EXPECT_DOUBLE_EQ(blobs[0].mass, 2);
  }
  const auto nothing = [](Coord) { return 0.0; };
  const std::vector<Blob> blobs =
      fitBlobs(findCells(boxMedium(Coord(8, 8, 8), Transform::uniform(1), nothing), 100), count(10));
  EXPECT_EQ(blobs.size(), 10u);
  for (const Blob& blob : blobs) EXPECT_TRUE(std::isfinite(blob.sigma) && blob.sigma > 0);
}

}  // namespace
}  // namespace vdb_diffuse
