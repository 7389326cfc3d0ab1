#include "blobs/blob_light.h"

#include <gtest/gtest.h>

#include "volumes.h"

namespace vdb_diffuse {
namespace {

DiffuseSettings p1() {
  DiffuseSettings settings;
  settings.model.model = Model::kP1;
  return settings;
}

/// RMS of the difference over the RMS of b, weighted by density.
double error(const Medium& medium, const Field<float>& a, const Field<float>& b) {
  double above = 0, below = 0;
  const Field<float>& rho = medium.density.values;
  for (size_t i = 0; i < a.size(); ++i) {
    above += rho[i] * (a[i] - b[i]) * (a[i] - b[i]);
    below += rho[i] * b[i] * b[i];
  }
  return std::sqrt(above / below);
}

/// A lump whose density falls to nothing, about 12 optical depths across.
Medium lump() {
  return boxMedium(Coord(40, 40, 40), Transform::uniform(0.5), [](Coord p) {
    const double r = (p.asVec3d() - Vec3d(19.5)).length() / 19;
    return r < 1 ? 1.2 * (1 - r * r) : -1;
  });
}

double blobError(const Medium& medium, int count, BlobForm form, bool centres, BlobReport* report = nullptr) {
  const Scene sun = sunScene(Vec3d(0.3, 0.2, -1));
  BlobSettings settings;
  settings.count = count;
  settings.form = form;
  settings.source_at_centres = centres;
  const DiffuseResult by_blobs = blobLight(medium, sun, p1(), settings, report);
  return error(medium, by_blobs.diffuse[0], diffuse(medium, sun, p1()).diffuse[0]);
}

// The same equation on the voxels is what they come near to, dense and sparse systems alike.
TEST(BlobLight, MoreBlobsComeNearer) {
  const Medium medium = lump();
  const double few = blobError(medium, 30, BlobForm::kGalerkin, false),
               some = blobError(medium, 200, BlobForm::kGalerkin, false),
               many = blobError(medium, 1200, BlobForm::kGalerkin, false);
  EXPECT_LT(some, 0.6 * few);
  EXPECT_LT(many, 0.8 * some);
  EXPECT_LT(some, 0.05);
}

TEST(BlobLight, TheSourceAtTheCentresIsCoarser) {
  const Medium medium = lump();
  EXPECT_GT(blobError(medium, 200, BlobForm::kGalerkin, true),
            blobError(medium, 200, BlobForm::kGalerkin, false));
  EXPECT_LT(blobError(medium, 200, BlobForm::kGalerkin, true), 0.4);
}

TEST(BlobLight, GalerkinIsTheMoreStable) {
  const Medium medium = lump();
  BlobReport galerkin, collocation;
  const double near = blobError(medium, 100, BlobForm::kGalerkin, false, &galerkin);
  EXPECT_LT(near, blobError(medium, 100, BlobForm::kCollocation, false, &collocation));
  EXPECT_GT(galerkin.condition_number, 1);
  EXPECT_GT(collocation.condition_number, 1);
  EXPECT_EQ(galerkin.blobs, collocation.blobs);
}

// A ball that glows evenly and absorbs: the closed form of P1.
TEST(BlobLight, GlowingBallIsTheClosedForm) {
  const double R = 5, sigma_a = 0.1, D = 1 / 3.3, k = std::sqrt(sigma_a / D);
  Medium ball = ballMedium(R, 0.25);
  ball.optics.sigma_a = Vec3d(sigma_a);
  setEmission(ball, [](Coord) { return 1; });
  DiffuseSettings settings = p1();
  settings.model.model = Model::kDefault;  // for its area factor
  settings.model.mean_free_path_cap = HUGE_VAL;
  BlobSettings blobs;
  const DiffuseResult result = blobLight(ball, Scene(), settings, blobs);
  const double A =
      1 / (std::sinh(k * R) / (k * R) + 2 * D * (std::cosh(k * R) / R - std::sinh(k * R) / (k * R * R)));
  double sum = 0, square = 0;
  forEachVoxel(ball.topology(), [&](Coord p, size_t i) {
    const double centre = 0.5 * (2 * (static_cast<int>(R / 0.25) + 2) - 1);
    const double r = std::max(1e-6, (p.asVec3d() - Vec3d(centre)).length() * 0.25);
    const double J = 1 - A * std::sinh(k * r) / (k * r);
    sum += (result.diffuse[0][i] - J) * (result.diffuse[0][i] - J);
    square += J * J;
  });
  EXPECT_LT(std::sqrt(sum / square), 0.05);
}

TEST(BlobLight, EnergyClosesAndColoursAndFluxAreThere) {
  Medium medium = lump();
  medium.optics.sigma_s = Vec3d(1, 0.6, 0.3);
  medium.optics.sigma_a = Vec3d(0.02);
  medium.optics.g = 0.6;
  for (const BlobForm form : {BlobForm::kGalerkin, BlobForm::kCollocation})
    for (const bool centres : {false, true}) {
      BlobSettings blobs;
      blobs.count = 80;
      blobs.form = form;
      blobs.source_at_centres = centres;
      DiffuseSettings settings;
      settings.want_flux = true;
      const DiffuseResult result = blobLight(medium, sunScene(Vec3d(0, 0, -1)), settings, blobs);
      EXPECT_LT(std::abs(result.energy.closure()), 1e-5);
      ASSERT_EQ(result.diffuse.size(), 3u);
      ASSERT_EQ(result.direct.size(), 3u);
      double flux = 0;
      for (size_t i = 0; i < result.flux[2].size(); ++i) {
        EXPECT_TRUE(std::isfinite(result.diffuse[0][i]) && result.diffuse[0][i] >= 0);
        flux += result.flux[2][i];
      }
      EXPECT_LT(flux, 0);  // on the whole the light goes on down
    }
}

// Another place, other units: the same light.
TEST(BlobLight, DoesNotDependOnPlaceOrUnit) {
  const Coord moved(8, -16, 800);
  const auto mediumAt = [](double h, const Coord& offset) {
    Medium medium = boxMedium(
        Coord(24, 24, 24), Transform::uniform(h, Vec3d(1e3 * h)), [](Coord p) { return lumpyDensity(p, 9); },
        offset);
    medium.optics.sigma_s = Vec3d(0.5 / h);
    return medium;
  };
  const auto lightIn = [](const Medium& medium) {
    BlobSettings blobs;
    blobs.count = 60;
    return blobLight(medium, sunScene(Vec3d(0.2, -0.5, -1)), p1(), blobs).diffuse[0];
  };
  const Medium one = mediumAt(1, Coord(0)), other = mediumAt(1024, moved);
  EXPECT_LT(largestDifference(one.topology(), lightIn(one), other.topology(), lightIn(other),
                              [&](Coord p) { return p + moved; }),
            1e-4);
}

}  // namespace
}  // namespace vdb_diffuse
