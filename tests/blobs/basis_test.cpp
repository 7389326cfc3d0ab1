#include "blobs/basis.h"

#include <gtest/gtest.h>

#include "volumes.h"

namespace vdb_diffuse {
namespace {

struct Case {
  Medium medium = boxMedium(
      Coord(30, 20, 24), Transform(Vec3d(1, 0, 0), Vec3d(0, 1.5, 0), Vec3d(0, 0, 0.7), {}),
      [](Coord p) { return lumpyDensity(p, 2); }, Coord(-3, 5, 2));
  Cells cells = findCells(medium, 1500);
  std::vector<Blob> blobs;
  Case() {
    FitSettings settings;
    settings.count = 40;
    settings.overlap = 2;
    blobs = fitBlobs(cells, settings);
  }
};

TEST(BlobBasis, DerivativesAreThoseOfTheValues) {
  const Case c;
  const double d = 1e-4;
  const Vec3d p = c.blobs[7].centre + Vec3d(0.3, -0.2, 0.5);
  const BasisAt at = basisAt(c.blobs, p);
  ASSERT_GT(at.blob.size(), 3u);
  std::vector<double> laplacian(at.blob.size(), 0.0);
  for (int a = 0; a < 3; ++a) {
    Vec3d step(0);
    step[a] = d;
    const BasisAt up = basisAt(c.blobs, p + step), down = basisAt(c.blobs, p - step);
    ASSERT_EQ(up.blob, at.blob);
    ASSERT_EQ(down.blob, at.blob);
    for (size_t k = 0; k < at.blob.size(); ++k) {
      EXPECT_NEAR(at.gradient[k][a], (up.value[k] - down.value[k]) / (2 * d), 1e-6);
      laplacian[k] += (up.value[k] + down.value[k] - 2 * at.value[k]) / (d * d);
    }
    EXPECT_NEAR(at.density_gradient[a], (up.density - down.density) / (2 * d), 1e-6);
  }
  for (size_t k = 0; k < at.blob.size(); ++k) EXPECT_NEAR(at.laplacian[k], laplacian[k], 1e-5);
}

// So a constant light satisfies the printed equations of a medium that absorbs nothing, wherever the centres
// are and whatever its boundary: their matrix times (1,1,..) is zero.
TEST(Blobs, CollocationAsPrintedIsSingular) {
  const Case c;
  for (const Blob& blob : c.blobs) {
    const BasisAt at = basisAt(c.blobs, blob.centre);
    double value = 0, laplacian = 0;
    Vec3d gradient(0);
    for (size_t k = 0; k < at.blob.size(); ++k) {
      value += at.value[k];
      gradient += at.gradient[k];
      laplacian += at.laplacian[k];
    }
    EXPECT_NEAR(value, 1, 1e-12);
    EXPECT_NEAR(gradient.length(), 0, 1e-12);
    EXPECT_NEAR(laplacian, 0, 1e-12);
  }
}

TEST(BlobBasis, EvenLightIsEven) {
  const Case c;
  Field<float> field(c.medium.topology());
  evaluate(c.blobs, basisOnCells(c.blobs, c.cells), c.cells, c.medium.topology(),
           std::vector<double>(c.blobs.size(), 3.0), field);
  forEachVoxel(c.medium.topology(), [&](Coord, size_t i) { EXPECT_NEAR(field[i], 3, 1e-5); });
}

TEST(BlobBasis, VoxelsAndPointsAgree) {
  const Case c;
  std::vector<double> values;
  for (size_t i = 0; i < c.blobs.size(); ++i) values.push_back(hashed(Coord(static_cast<int>(i), 0, 0)));
  Field<double> field(c.medium.topology());
  evaluate(c.blobs, basisOnCells(c.blobs, c.cells), c.cells, c.medium.topology(), values, field);
  forEachVoxel(c.medium.topology(), [&](Coord p, size_t i) {
    const BasisAt at = basisAt(c.blobs, c.cells.frame(p));
    double sum = 0;
    for (size_t k = 0; k < at.blob.size(); ++k) sum += at.value[k] * values[at.blob[k]];
    if (at.density > 1e-6) {
      EXPECT_NEAR(field[i], sum, 1e-4) << p;
    }
  });
}

TEST(BlobBasis, CellsSharesAddUpToOne) {
  const Case c;
  const CellBasis basis = basisOnCells(c.blobs, c.cells);
  for (size_t b = 0; b < basis.blobs.size(); ++b)
    for (size_t cell = 0; cell < c.cells.first[b + 1] - c.cells.first[b]; ++cell) {
      double value = 0;
      Vec3d gradient(0);
      for (size_t e = basis.at(b, cell); e < basis.at(b, cell + 1); ++e) {
        value += basis.value[e];
        for (int axis = 0; axis < 3; ++axis) gradient[axis] += basis.gradient[axis][e];
      }
      EXPECT_NEAR(value, 1, 1e-5);
      EXPECT_NEAR(gradient.length(), 0, 1e-5);
    }
}

TEST(BlobBasis, ACellOutOfReachBelongsToTheNearestBlob) {
  Case c;
  c.blobs.resize(2);
  for (Blob& blob : c.blobs) blob.sigma = 0.3;
  const CellBasis basis = basisOnCells(c.blobs, c.cells);
  std::vector<double> held =
      weighedByBlobs(basis, c.cells, 2, {c.cells.volume.begin(), c.cells.volume.end()});
  EXPECT_NEAR(held[0] + held[1], static_cast<double>(c.medium.topology().activeVoxelCount()), 1e-3);
  EXPECT_GT(std::min(held[0], held[1]), 1);
}

}  // namespace
}  // namespace vdb_diffuse
