#include "reference/runs.h"

namespace vdb_diffuse {
namespace {

/// Empty layers at both ends of a slab tell what leaves it: their flux, which nothing brings back.
double powerThrough(const Medium& medium, const ReferenceResult& result, int layer) {
  const double width = medium.transform().axis(0).length();
  return result.flux[2].at(medium.topology(), Coord(0, 0, layer)) * width * width;
}

// van de Hulst, "Multiple Light Scattering" (1980), table 35: Henyey-Greenstein, g .75, albedo .9, depth 2,
// normal incidence. Reflected .09739, transmitted .66096 with the uncollided exp(-2).
TEST(ReferenceSlab, ReflectsAndTransmitsAsVanDeHulst) {
  constexpr int kLayers = 10;  // 8 of the slab, each a quarter deep
  Medium medium = slabMedium(kLayers, 2.5, 1e3, [](int z) { return z > 0 && z < kLayers - 1 ? 1 : 0; });
  setOptics(medium, 1, 0.9, 0.75);
  Repeated reflected, transmitted;
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    ReferenceSettings settings = paths(8e4, seed);
    settings.want_flux = true;
    const ReferenceResult result = reference(medium, pencil(5), settings);
    const double power = result.energy.scattered_in / (0.9 * (1 - std::exp(-2)));
    reflected.values.push_back(powerThrough(medium, result, kLayers - 1) / power);
    transmitted.values.push_back(-powerThrough(medium, result, 0) / power + std::exp(-2));
  }
  expectMean(reflected, 0.09739, "R");
  expectMean(transmitted, 0.66096, "T");
  EXPECT_LT(reflected.error(), 4e-3 * reflected.mean());
  EXPECT_LT(transmitted.error(), 1e-3 * transmitted.mean());
}

// Some mean free paths from any source, the intensity in a conservative medium that lets a flux F out is
// 3 F (z + 0.7104) / (4 pi), z mean free paths below the surface (diffusion with Marshak's wall has 2/3). The
// source is one layer that glows: it hardly absorbs, but glows all the more.
TEST(ReferenceSlab, MilnesExtrapolationLength) {
  constexpr int kLayers = 48;
  constexpr double kDepth = 12, kStep = kDepth / kLayers, kAbsorption = 1e-9;
  Medium medium = slabMedium(kLayers, kDepth, 1e6, [](int) { return 1.0; });
  setOptics(medium, 1, 1 - kAbsorption);
  setEmission(medium, [](Coord p) { return p[2] == 36 ? 1 / kAbsorption : 0; });
  Repeated length;
  for (uint64_t seed = 1; seed <= 16; ++seed) {
    ReferenceSettings settings = paths(2e4, seed);
    settings.want_flux = true;
    const ReferenceResult result = reference(medium, {}, settings);
    double flux = 0, excess = 0;
    constexpr int kFirst = static_cast<int>(2.5 / kStep), kLast = static_cast<int>(4 / kStep);
    for (int layer = 0; layer < kLast; ++layer)
      flux -= result.flux[2].at(medium.topology(), Coord(0, 0, layer)) / kLast;
    for (int layer = kFirst; layer < kLast; ++layer) {
      const double mean = result.diffuse[0].at(medium.topology(), Coord(0, 0, layer));
      excess += (4 * M_PI * mean / (3 * flux) - (layer + 0.5) * kStep) / (kLast - kFirst);
    }
    length.values.push_back(excess);
  }
  expectMean(length, 0.7104);
  EXPECT_LT(length.error(), (0.7104 - 2. / 3) / 3);
}

// Light that has not collided is known without noise: exp(-tau / mu), averaged over each voxel.
TEST(ReferenceSlab, UncollidedLightIsExponential) {
  for (double sigma : {0.01, 0.5, 8.0})
    for (double mu : {1.0, 0.6, 0.05}) {
      constexpr int kLayers = 12;
      Medium medium = slabMedium(kLayers, 3, 1e7, [](int z) { return 0.5 + z % 3; });
      setOptics(medium, sigma, 0.5);
      const ReferenceResult result =
          reference(medium, sunScene(Vec3d(std::sqrt(1 - mu * mu), 0, -mu)), paths(2000));
      double before = 0;
      for (int layer = kLayers - 1; layer >= 0; --layer) {
        const double inside = sigma * (0.5 + layer % 3) * 3 / kLayers / mu;
        const double expected = std::exp(-before) * -std::expm1(-inside) / inside / (4 * M_PI);
        before += inside;
        if (before > 60) break;
        ASSERT_NEAR(result.direct[0].at(medium.topology(), Coord(0, 0, layer)), expected,
                    (2 + before) * 1e-5 * expected)
            << "sigma " << sigma << " mu " << mu << " layer " << layer;
      }
    }
}

// What comes in goes somewhere, to rounding; and the light that is absorbed is that of the lit voxels.
TEST(ReferenceSlab, EnergyCloses) {
  for (double albedo : {1.0, 0.9, 0.3})
    for (double g : {0.0, 0.85}) {
      Medium medium =
          boxMedium(Coord(9, 7, 8), Transform::uniform(0.5), [](Coord p) { return lumpyDensity(p); });
      setOptics(medium, 3, albedo, g);
      if (albedo == 0.9) setEmission(medium, [](Coord p) { return hashed(p, 5); });
      const ReferenceResult result = reference(medium, sunScene(Vec3d(1, 2, -3)), paths(5e4));
      EXPECT_LT(std::abs(result.energy.closure()), 1e-12) << albedo << ' ' << g;
      EXPECT_EQ(result.energy.lost, 0);
      double absorbed = 0;
      forEachVoxel(medium.topology(), [&](Coord, size_t i) {
        absorbed += 4 * M_PI * medium.optics.sigma_a[0] * medium.density.values[i] * result.diffuse[0][i] *
                    medium.transform().voxelVolume();
      });
      if (albedo < 1) {
        EXPECT_NEAR(absorbed / result.energy.absorbed, 1, 0.01) << albedo << ' ' << g;
      }
      EXPECT_EQ(result.energy.emitted > 0, albedo == 0.9);
    }
}

}  // namespace
}  // namespace vdb_diffuse
