#include "transport/illuminate.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "volumes.h"

namespace vdb_diffuse {
namespace {

constexpr double kTolerance = 1e-5;

DiffuseResult lit(const Medium& medium, const Scene& scene, int sweeps, Model model = Model::kDefault,
                  double tolerance = kTolerance, int directions = 96) {
  DiffuseSettings settings;
  settings.model.model = model;
  settings.tolerance = tolerance;
  settings.want_flux = true;
  TransportSettings transport;
  transport.sweeps = sweeps;
  transport.directions = directions;
  const DiffuseResult result = illuminate(medium, scene, settings, transport);
  EXPECT_TRUE(result.converged) << sweeps << " sweeps";
  EXPECT_LT(std::abs(result.energy.closure()), 10 * tolerance) << sweeps << " sweeps";
  return result;
}

void setOptics(Medium& medium, double sigma_t, double albedo, double g) {
  medium.optics.sigma_s = Vec3d(sigma_t * albedo);
  medium.optics.sigma_a = Vec3d(sigma_t * (1 - albedo));
  medium.optics.g = g;
}

/// Relative RMS of a - b over the active voxels.
double difference(const Topology& topology, const Field<float>& a, const Field<float>& b) {
  double square = 0, all = 0;
  forEachVoxel(topology, [&](Coord, size_t i) {
    square += (a[i] - b[i]) * (a[i] - b[i]);
    all += b[i] * b[i];
  });
  return std::sqrt(square / all);
}

Medium lumpyMedium(double sigma_t, double albedo, double g) {
  Medium medium =
      boxMedium(Coord(20, 17, 19), Transform::uniform(0.5), [](Coord p) { return lumpyDensity(p); });
  setOptics(medium, sigma_t, albedo, g);
  return medium;
}

Scene skyScene(double L) {
  Scene scene;
  scene.lights.push_back({"sky", DomeLight{Vec3d(L), nullptr, 0}});
  return scene;
}

// Under a sky of radiance L all light together is L in every place (see the furnace of physics/).
TEST(Illuminate, SweepsFillTheFurnaceEvenly) {
  constexpr double kRadius = 4, kL = 3;
  for (double tau : {0.1, 2.0, 10.0, 30.0})  // optical radius: up to 2.5 in a voxel
    for (double g : {0.0, 0.7})
      for (double albedo : {1.0, 0.9}) {
        Medium medium = ballMedium(kRadius, kRadius / 12);
        setOptics(medium, tau / kRadius, albedo, g);
        if (albedo < 1) setEmission(medium, [](Coord) { return kL; });
        const DiffuseResult result = lit(medium, skyScene(kL), 4);
        double square = 0, sum = 0, count = 0;
        forEachVoxel(medium.topology(), [&](Coord, size_t i) {
          const double off = (static_cast<double>(result.direct[0][i]) + result.diffuse[0][i]) / kL - 1;
          square += off * off;
          sum += off;
          count += 1;
        });
        const double voxel = tau / 12, room = 0.025 * voxel;  // few rays cross a voxel
        EXPECT_LT(std::sqrt(square / count), 0.012 + room)
            << "optical radius " << tau << " g " << g << " albedo " << albedo;
        EXPECT_LT(std::abs(sum / count), 0.008 + room)
            << "optical radius " << tau << " g " << g << " albedo " << albedo;
      }
}

/// The middle column of a wide flat box, lit along its normal from above.
struct SlabColumn {
  double R, T;           // diffuse light out of the top and the bottom, and the rest of the beam, of 1
  double extrapolation;  // length beyond the bottom at which deep light would be gone, in optical depths
};

SlabColumn slabColumn(double tau, double albedo, double g, int layers, int width, int sweeps,
                      int directions = 96) {
  Medium medium =
      boxMedium(Coord(width, width, layers), Transform::uniform(tau / layers), [](Coord) { return 1.0; });
  setOptics(medium, 1, albedo, g);
  const DiffuseResult result =
      lit(medium, sunScene(Vec3d(0, 0, -1)), sweeps, Model::kDefault, 1e-4, directions);
  const Topology& topology = medium.topology();
  const auto column = [&](const Field<float>& field, int k) {  // of a patch: rays meet neighbours elsewhere
    double sum = 0;
    for (int n = 0; n < 64; ++n)
      sum += field.at(topology, Coord(width / 2 - 4 + n / 8, width / 2 - 4 + n % 8, k));
    return sum / 64;
  };
  const auto flux = [&](int k) { return column(result.flux[2], k); };
  const int top = layers - 1;
  SlabColumn slab;  // at a face by the parabola through three centres
  slab.R = (15 * flux(top) - 10 * flux(top - 1) + 3 * flux(top - 2)) / 8;
  slab.T = -(15 * flux(0) - 10 * flux(1) + 3 * flux(2)) / 8 + std::exp(-tau);
  const int near = layers / 4, far = layers / 2;
  const double h = tau / layers, J_near = column(result.diffuse[0], near),
               J_far = column(result.diffuse[0], far);
  slab.extrapolation = h * ((near + 0.5) * J_far - (far + 0.5) * J_near) / (J_near - J_far);
  return slab;
}

// Van de Hulst's slab of two optical depths, albedo 0.9, g 0.75: R = 0.09739, T = 0.66096. What three moments
// of the phase function leave wrong of R does not go away with more sweeps.
TEST(Illuminate, SlabReflectsAndTransmitsAsTransportHasIt) {
  constexpr double kR = 0.09739, kT = 0.66096;
  const auto slab = [](int sweeps) { return slabColumn(2, 0.9, 0.75, 12, 80, sweeps); };
  const SlabColumn one = slab(1), four = slab(4);
  const auto error = [&](const SlabColumn& s) { return std::hypot(s.R - kR, s.T - kT); };
  EXPECT_NEAR(four.R, kR, 0.01);
  EXPECT_NEAR(four.T, kT, 0.005);
  EXPECT_LT(error(four), 0.8 * error(one));
}

// Milne: deep in a conservative isotropic half space light falls on a line that ends 0.7104 mean free paths
// beyond the surface; diffusion has 2/3.
TEST(Illuminate, MilnesExtrapolationLength) {
  const auto length = [](int sweeps) { return slabColumn(12, 1, 0, 24, 104, sweeps).extrapolation; };
  const double diffusion = length(0), four = length(4);
  EXPECT_NEAR(diffusion, 2.0 / 3, 0.01);
  EXPECT_NEAR(four, 0.7104, 0.03);  // layers of half an optical depth, and sides that are not far away
  EXPECT_LT(std::abs(four - 0.7104), 0.6 * std::abs(diffusion - 0.7104));
}

TEST(Illuminate, ForgetsTheModelThatItStartsFrom) {
  const Scene sun = sunScene(Vec3d(0.3, -0.5, -1));
  const Medium medium = lumpyMedium(0.9, 0.99, 0);  // half an optical depth in the densest voxel
  double before = HUGE_VAL;
  for (int sweeps : {0, 1, 2, 4, 8}) {
    const DiffuseResult a = lit(medium, sun, sweeps), b = lit(medium, sun, sweeps, Model::kP1);
    const double now = difference(medium.topology(), a.diffuse[0], b.diffuse[0]);
    if (sweeps < 8) {
      EXPECT_LT(now, (sweeps > 2 ? 0.5 : 0.9) * before) << sweeps << " sweeps";
    }
    before = now;
  }
  EXPECT_LT(before,
            0.015);  // they start from 1.1, and see the light's slopes in the voxels a little differently
}

// Forward scattering in a thin medium settles slowly, step by step by the same part.
TEST(Illuminate, StepsGoOnIntoWhatTheNextWouldBring) {
  const Scene sun = sunScene(Vec3d(0.3, -0.5, -1));
  Medium medium = ballMedium(8, 0.5);
  setOptics(medium, 1, 1, 0.85);
  const DiffuseResult settled = lit(medium, sun, 24);
  const auto off = [&](int sweeps) {
    return difference(medium.topology(), lit(medium, sun, sweeps).diffuse[0], settled.diffuse[0]);
  };
  const double start = off(0);
  EXPECT_LT(off(2), 0.15 * start);   // 0.10; steps by themselves leave 0.26
  EXPECT_LT(off(6), 0.003 * start);  // 0.0011, and 0.017
}

// Once at rest, changes are rounding and no longer fall: nothing to warn of.
TEST(Illuminate, RestsInAThinMediumWithoutAWord) {
  Medium medium = ballMedium(4, 0.5);
  setOptics(medium, 0.5, 0.9, 0.85);
  const DiffuseResult settled = lit(medium, sunScene(Vec3d(0.3, -0.5, -1)), 60);
  EXPECT_EQ(settled.sweeps, 60);
  EXPECT_TRUE(settled.warnings.empty()) << settled.warnings.front();
}

// In voxels of up to two optical depths. Thicker ones do not settle, nor do two optical depths in voxels that
// all differ.
TEST(Illuminate, SettlesInThinVoxels) {
  const Scene sun = sunScene(Vec3d(0.3, -0.5, -1));
  for (double depth : {0.5, 2.0})  // of the densest voxel
    for (double g : {0.0, 0.85}) {
      Medium medium = depth < 1 ? lumpyMedium(depth / (1.1 * 0.5), 1, g) : ballMedium(4, 0.5);
      if (depth > 1) setOptics(medium, depth / 0.5, 1, g);
      DiffuseResult last = lit(medium, sun, 0);
      double first_change = 0;
      for (int sweeps : {1, 8, 16}) {
        DiffuseResult now = lit(medium, sun, sweeps);
        const double change = difference(medium.topology(), now.diffuse[0], last.diffuse[0]);
        if (sweeps == 1) first_change = change;
        if (sweeps == 16) {
          EXPECT_LT(change, 0.004) << "depth " << depth << " g " << g << ", first " << first_change;
        }
        last = std::move(now);
      }
    }
}

TEST(Illuminate, MirroredVolumeIsLitTheSame) {
  const Coord size(20, 17, 19);
  for (double g : {0.0, 0.6}) {
    const auto volume = [&](bool mirrored) {
      Medium medium = boxMedium(size, Transform::uniform(0.5), [=](Coord p) {
        return lumpyDensity(mirrored ? Coord(19 - p[0], p[1], p[2]) : p);
      });
      setOptics(medium, 2, 0.95, g);
      return medium;
    };
    const Medium plain = volume(false), mirrored = volume(true);
    const DiffuseResult a = lit(plain, sunScene(Vec3d(0, 0, -1)), 2, Model::kDefault, 1e-7),
                        b = lit(mirrored, sunScene(Vec3d(0, 0, -1)), 2, Model::kDefault, 1e-7);
    EXPECT_LT(largestDifference(plain.topology(), a.diffuse[0], mirrored.topology(), b.diffuse[0],
                                [](Coord p) { return Coord(19 - p[0], p[1], p[2]); }),
              1e-5);
  }
}

TEST(Illuminate, UnitsAndThreadsChangeNoBit) {
  const Scene sun = sunScene(Vec3d(0.3, -0.5, -1)), bright = sunScene(Vec3d(0.3, -0.5, -1), Vec3d(0x1p40));
  const Medium medium = lumpyMedium(2, 0.95, 0.6);
  Medium large =
      boxMedium(Coord(20, 17, 19), Transform::uniform(0.5 * 1024), [](Coord p) { return lumpyDensity(p); });
  setOptics(large, 2.0 / 1024, 0.95, 0.6);
  const auto withThreads = [&](int threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, std::max(threads, 2));
    tbb::task_arena arena(threads);
    DiffuseResult result;
    arena.execute([&] { result = lit(medium, sun, 2); });
    return result;
  };
  const DiffuseResult one = withThreads(1), two = withThreads(2), scaled = lit(large, sun, 2),
                      brighter = lit(medium, bright, 2);
  forEachVoxel(medium.topology(), [&](Coord, size_t i) {
    ASSERT_EQ(one.diffuse[0][i], two.diffuse[0][i]);
    ASSERT_EQ(one.diffuse[0][i], scaled.diffuse[0][i]);
    ASSERT_EQ(one.diffuse[0][i] * 0x1p40f, brighter.diffuse[0][i]);
    for (int a = 0; a < 3; ++a) ASSERT_EQ(one.flux[a][i], two.flux[a][i]);
  });
  EXPECT_EQ(one.energy.escaped, two.energy.escaped);
}

}  // namespace
}  // namespace vdb_diffuse
