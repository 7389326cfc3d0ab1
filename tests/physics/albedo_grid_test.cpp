#include <gtest/gtest.h>

#include "blobs/blob_light.h"
#include "reference/path_tracer.h"
#include "transport/illuminate.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

// A medium that scatters sigma_s a(x) and absorbs sigma_a + (1 - a(x)) sigma_s in each place.

struct How {
  const char* name;
  int sweeps = 0;
  Model model = Model::kDefault;
  bool exact_march = false;
  std::optional<BlobForm> blobs = {};
};

const How kDiffusion{"diffusion"}, kSwept{"two sweeps", 2}, kP1{"P1", 0, Model::kP1},
    kPaper{"as printed", 0, Model::kPaper}, kMarch{"exact march", 2, Model::kDefault, true},
    kBlobs{"blobs", 0, Model::kDefault, false, BlobForm::kGalerkin},
    kCollocation{"collocation", 0, Model::kDefault, false, BlobForm::kCollocation};

DiffuseResult lit(const Medium& medium, const Scene& scene, const How& how, double tolerance = 1e-6) {
  DiffuseSettings settings;
  settings.model.model = how.model;
  settings.source.exact_march = how.exact_march;
  settings.tolerance = tolerance;
  settings.want_flux = true;
  TransportSettings transport;
  transport.sweeps = how.sweeps;
  BlobSettings blobs;
  blobs.count = 60;
  if (how.blobs) blobs.form = *how.blobs;
  const DiffuseResult result =
      how.blobs ? blobLight(medium, scene, settings, blobs) : illuminate(medium, scene, settings, transport);
  EXPECT_TRUE(result.converged) << how.name;
  return result;
}

/// A lump whose densest voxels have this optical depth.
Medium lump(double depth, double g, bool coloured = false) {
  Medium medium =
      boxMedium(Coord(13, 11, 12), Transform::uniform(0.4), [](Coord p) { return lumpyDensity(p); });
  const double sigma = depth / 0.4 / 1.1;
  medium.optics.sigma_s = coloured ? Vec3d(1, 0.7, 0.5) * sigma : Vec3d(sigma);
  medium.optics.sigma_a = coloured ? Vec3d(0, 0.1, 0.05) * sigma : Vec3d(0.02) * sigma;
  medium.optics.g = g;
  return medium;
}

/// A sun, a lamp in the medium, and a bright wall beside it that both of them light.
Scene everyLight() {
  Scene scene = sunScene(Vec3d(0.4, 0.2, -1), Vec3d(3, 2, 1));
  scene.lights.push_back({"lamp", PointLight{Vec3d(2.1, 2.3, 2.2), Vec3d(2, 3, 4), 0}});
  scene.surfaces.push_back(
      {"wall", quad(Vec3d(-1, 0, 0), Vec3d(0, 5, 0), Vec3d(0, 0, 5)), Vec3d(0.9, 0.6, 0.3)});
  return scene;
}

void expectEqualLight(const Medium& medium, const DiffuseResult& a, const DiffuseResult& b, double tolerance,
                      const std::string& where) {
  ASSERT_EQ(a.diffuse.size(), b.diffuse.size()) << where;
  for (size_t c = 0; c < a.diffuse.size(); ++c) {
    EXPECT_LT(largestDifference(medium.topology(), a.diffuse[c], b.diffuse[c]), tolerance) << where;
    EXPECT_LT(largestDifference(medium.topology(), a.direct[c], b.direct[c]), tolerance) << where;
  }
  for (int k = 0; k < 3; ++k)
    EXPECT_LT(largestDifference(medium.topology(), a.flux[k], b.flux[k]), 5 * tolerance) << where;
  const double in = b.energy.scattered_in + b.energy.emitted;
  EXPECT_NEAR(a.energy.scattered_in, b.energy.scattered_in, tolerance * in) << where;
  EXPECT_NEAR(a.energy.emitted, b.energy.emitted, tolerance * in) << where;
  EXPECT_NEAR(a.energy.absorbed, b.energy.absorbed, 10 * tolerance * in) << where;
  EXPECT_NEAR(a.energy.escaped, b.energy.escaped, 10 * tolerance * in) << where;
}

// All that differs is the rounding of the solve.
TEST(AlbedoGrid, OneValueEverywhereIsThatAlbedo) {
  constexpr double kA = 0.7, kTolerance = 2e-5;
  for (const How& how : {kDiffusion, kSwept, kP1, kPaper, kMarch, kBlobs, kCollocation})
    for (const double g : {0.0, 0.6, -0.3})
      for (const double depth : {0.2, 2.0}) {
        const bool coloured = depth > 1;
        Medium with = lump(depth, g, coloured);
        setEmission(with, [](Coord p) { return 0.3 * hashed(p, 3); });
        Medium without = with;
        setAlbedo(with, [](Coord, int) { return kA; });
        without.optics.sigma_s *= kA;
        without.optics.sigma_a += with.optics.sigma_s * (1 - kA);
        const Scene scene = everyLight();
        ::testing::Message where;
        where << how.name << ", g " << g << ", depth " << depth;
        expectEqualLight(with, lit(with, scene, how), lit(without, scene, how), kTolerance,
                         where.GetString());
        const Channels source = sourceField(with, with.emission), plain = sourceField(without, with.emission);
        EXPECT_LT(largestDifference(with.topology(), source[0], plain[0]), 1e-6) << where;
      }
}

// In a grey medium under grey light colours do not mix.
TEST(AlbedoGrid, EachColourIsThatColourAlone) {
  const auto a = [](const Coord& p, int c) {
    return c == 0 ? hashed(p, 5) : c == 1 ? (p[2] < 6 ? 1 : 0.1) : 0.9;
  };
  for (const How& how : {kDiffusion, kSwept, kBlobs})
    for (const double g : {0.0, 0.6}) {
      Medium all = lump(1, g), one = all;
      setAlbedo(all, a, 3);
      const Scene sun = sunScene(Vec3d(0, 0.3, -1));
      const DiffuseResult together = lit(all, sun, how);
      ASSERT_EQ(together.diffuse.size(), 3u);
      for (int c = 0; c < 3; ++c) {
        setAlbedo(one, [&](Coord p, int) { return a(p, c); });
        const DiffuseResult alone = lit(one, sun, how);
        ASSERT_EQ(alone.diffuse.size(), 1u);
        EXPECT_LT(largestDifference(all.topology(), together.diffuse[c], alone.diffuse[0]), 2e-5)
            << how.name << ", g " << g << ", channel " << c;
      }
    }
}

// A sky of radiance L, and in it stuff that glows with L as well: L is everywhere, whatever scatters where.
TEST(AlbedoGrid, FillsTheFurnaceEvenly) {
  constexpr double kL = 3;
  Scene scene;
  scene.lights.push_back({"sky", DomeLight{Vec3d(kL), nullptr, 0}});
  for (const double g : {0.0, 0.6})
    for (const double depth : {0.1, 0.5}) {
      const auto off = [&](const How& how, bool varies) {
        Medium medium = ballMedium(4, 4 / 12.);
        medium.optics.sigma_s = Vec3d(depth * 3);
        medium.optics.g = g;
        setEmission(medium, [](Coord) { return kL; });
        if (varies) setAlbedo(medium, [](Coord p, int) { return p[0] < 14 ? 1 : hashed(p, 4); });
        const DiffuseResult result = lit(medium, scene, how, 1e-5);
        double square = 0, count = 0;
        forEachVoxel(medium.topology(), [&](Coord, size_t i) {
          square += std::pow((static_cast<double>(result.direct[0][i]) + result.diffuse[0][i]) / kL - 1, 2);
          count += 1;
        });
        return std::sqrt(square / count);
      };
      const How four{"four sweeps", 4};
      for (const How& how : {kDiffusion, four}) {
        const double plain = off(how, false), varied = off(how, true);
        EXPECT_LT(varied, 1.1 * plain)
            << how.name << ", g " << g << ", depth " << depth << ", plain " << plain;
      }
      EXPECT_LT(off(four, true), 0.02) << "g " << g << ", depth " << depth;
    }
}

/// 4 pi V sum of sigma(c, i) rho I, by luminance.
template <typename Sigma>
double power(const Medium& medium, const Sigma& sigma, const Channels& I) {
  double sum = 0;
  for (int c = 0; c < 3; ++c) {
    const Field<float>& channel = I[I.size() == 1 ? 0 : c];
    forEachVoxel(medium.topology(), [&](Coord, size_t i) {
      sum += kLuminance[c] * sigma(c, i) * medium.density.values[i] * channel[i];
    });
  }
  return 4 * M_PI * medium.transform().voxelVolume() * sum;
}

TEST(AlbedoGrid, EnergyCloses) {
  for (const How& how : {kDiffusion, kP1, kSwept})
    for (const double g : {0.0, 0.7, -0.4})
      for (const int channels : {1, 3}) {
        Medium medium = lump(0.8, g, channels == 3);
        setEmission(medium, [](Coord p) { return hashed(p, 11); });
        setAlbedo(
            medium, [](Coord p, int c) { return hashed(p, 17 + c) < 0.2 ? 0 : hashed(p, 21 + c); }, channels);
        const DiffuseResult result = lit(medium, everyLight(), how, 1e-5);
        ::testing::Message where;
        where << how.name << ", g " << g << ", " << channels << " channels";
        EXPECT_LT(std::abs(result.energy.closure()), 1e-4) << where;
        const double in = result.energy.scattered_in + result.energy.emitted;
        const auto scatters = [&](int c, size_t i) {
          return medium.optics.sigma_s[c] * (*medium.albedoIn(c))[i];
        };
        const auto absorbs = [&](int c, size_t i) { return medium.absorptionIn(c, i); };
        EXPECT_NEAR(result.energy.scattered_in, power(medium, scatters, result.direct), 1e-5 * in) << where;
        EXPECT_NEAR(result.energy.emitted, power(medium, absorbs, medium.emission), 1e-5 * in) << where;
        if (result.negative_voxels == 0) {
          EXPECT_NEAR(result.energy.absorbed, power(medium, absorbs, result.diffuse), 1e-4 * in) << where;
        }
      }
}

/// Density-weighted RMS over that of the reference, of means over 4^3 voxels, the reference's noise taken
/// off.
double offOnBlocks(const Medium& medium, const Field<float>& found, const ReferenceResult& truth) {
  struct Cell {
    double found = 0, truth = 0, variance = 0, rho = 0, count = 0;
  };
  std::map<Coord, Cell> cells;
  forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
    Cell& cell = cells[Coord(p[0] >> 2, p[1] >> 2, p[2] >> 2)];
    cell.found += found[i];
    cell.truth += truth.diffuse[0][i];
    cell.variance += std::pow(truth.correlation[1] * truth.diffuse_se[0][i], 2);
    cell.rho += medium.density.values[i];
    cell.count += 1;
  });
  double above = 0, below = 0;
  for (const auto& [p, cell] : cells) {
    const double weight = cell.rho / (cell.count * cell.count);
    above += weight * (std::pow(cell.found - cell.truth, 2) - cell.variance);
    below += weight * std::pow(cell.truth, 2);
  }
  return std::sqrt(std::max(0.0, above) / below);
}

// White below and dark above, or the other way round, against Monte Carlo. In voxels of up to 0.9 optical
// depths the light has a kink at the border, of which half as wide ones leave a third.
TEST(AlbedoGrid, TwoHalvesAreAsTransportHasThem) {
  for (const double g : {0.0, 0.6})
    for (const auto& [below, above] : {std::pair(1.0, 0.3), std::pair(0.3, 1.0)}) {
      Medium medium = boxMedium(Coord(14, 14, 16), Transform::uniform(0.5), [](Coord p) {
        return (p.asVec3d() - Vec3d(6.5, 6.5, 7.5)).length() < 7 ? 1.0 + 0.5 * hashed(p) : -1;
      });
      medium.optics.sigma_s = Vec3d(1.2);
      medium.optics.g = g;
      const double a[2] = {below, above};
      setAlbedo(medium, [&](Coord p, int) { return a[p[2] >= 8]; });
      const Scene sun = sunScene(Vec3d(0.5, 0, -1));
      ReferenceSettings paths;
      paths.samples = 1 << 16;
      const ReferenceResult truth = reference(medium, sun, paths);
      EXPECT_LT(std::abs(truth.energy.closure()), 1e-6);
      const auto off = [&](const How& how) {
        return offOnBlocks(medium, lit(medium, sun, how).diffuse[0], truth);
      };
      EXPECT_LT(off(kDiffusion), 0.1) << "g " << g << ", below " << below;
      EXPECT_LT(off(kSwept), 0.025) << "g " << g << ", below " << below;
    }
}

}  // namespace
}  // namespace vdb_diffuse
