#include "plane/v_cycle.h"

#include <gtest/gtest.h>

#include <cmath>

#include "plane/plane_media.h"

namespace vdb_diffuse {
namespace {

constexpr double kD = 0.07, kSink = 0.9, kA = 2.3, kB = -1.7;

double exact(double x, double y) {
  return 2 + std::cos(kA * x) * std::cos(kB * y);
}

/// Light that is chosen, in the square of side 1: the source and what comes in through the boundary follow.
struct Manufactured {
  PlaneSystem system;
  PlaneField I;

  explicit Manufactured(int n) {
    const PlaneGrid grid{n, n, 1.0 / n};
    const double h = grid.h, r = h / (2 * kD);
    system = {{grid, PlaneField(grid.count(), r), PlaneField(grid.count(), h * h * kSink)},
              PlaneField(grid.count())};
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const double x = (i + 0.5) * h, y = (j + 0.5) * h;
        I.push_back(exact(x, y));
        double& b = system.b[grid.at(i, j)];
        b = h * h * (kD * (kA * kA + kB * kB) * (exact(x, y) - 2) + kSink * exact(x, y));
        const auto wall = [&](double px, double py, double nx, double ny) {
          const double slope = -nx * kA * std::sin(kA * px) * std::cos(kB * py) -
                               ny * kB * std::cos(kA * px) * std::sin(kB * py);
          b += system.A.boundary(grid.at(i, j)) * (exact(px, py) + 2 * kD * slope);
        };
        if (i == 0) wall(0, y, -1, 0);
        if (i == n - 1) wall(1, y, 1, 0);
        if (j == 0) wall(x, 0, 0, -1);
        if (j == n - 1) wall(x, 1, 0, 1);
      }
  }

  double error() const {
    PlaneField x;
    VCycleSettings settings;
    settings.tolerance = 1e-10;
    EXPECT_TRUE(solveByVCycles(system, x, settings).converged);
    return relativeRms(x, I, PlaneField(x.size(), 1.0));
  }
};

TEST(VCycle, AManufacturedSolutionComesBackToSecondOrder) {
  const double coarse = Manufactured(32).error(), fine = Manufactured(64).error();
  EXPECT_LT(fine, 1e-4);
  EXPECT_NEAR(coarse / fine, 4, 0.4);
}

TEST(VCycle, CyclesAreAsManyOnAnyGrid) {
  size_t cycles[2];
  int k = 0;
  for (const int n : {64, 256}) {
    PlaneField x;
    cycles[k++] = solveByVCycles(Manufactured(n).system, x).residual.size() - 1;
  }
  EXPECT_LE(cycles[1], 10u);
  EXPECT_LE(cycles[1], cycles[0] + 1);
}

TEST(VCycle, RelaxesAsSection51Says) {
  VCycleSettings settings;
  settings.depth = 5;
  settings.relaxations = 3;
  settings.max_cycles = 1;
  PlaneField x;
  const VCycleReport report = solveByVCycles(Manufactured(64).system, x, settings);
  EXPECT_EQ(report.grids, 5);
  const std::vector<int> v{0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4, 3, 3, 3, 2, 2, 2, 1, 1, 1, 0, 0, 0};
  EXPECT_EQ(report.visits, v);
  EXPECT_NEAR(report.work, 6 * (1 + 1 / 4.0 + 1 / 16.0 + 1 / 64.0) + 3 / 256.0, 1e-12);
}

// P1 with the Marshak condition in a slab of 10 optical depths, closed form (tests/diffusion/slab_test.cpp):
// albedo 1, isotropic, and albedo 0.99, g 0.5. The middle of a wide layer is a slab.
TEST(PlaneEquation, CorrectedFormIsP1InASlab) {
  struct Slab {
    double albedo, g, middle, R, T;
  };
  for (const Slab& slab :
       {Slab{1, 0, 0.197337, 0.852943, 0.147057}, Slab{0.99, 0.5, 0.153373, 0.626675, 0.186326}}) {
    const PlaneMedium m = layerMedium(1024, 128, 10, slab.albedo, slab.g, 0, 1024);
    const PlaneSystem system = formPlaneSystem(m, PlaneForm::kCorrected);
    PlaneField I0;
    VCycleSettings settings;
    settings.tolerance = 1e-8;
    EXPECT_TRUE(solveByVCycles(system, I0, settings).converged);
    const PlaneExit exit = exitOf(m, system, I0);
    const double between = 0.5 * (I0[m.grid.at(512, 63)] + I0[m.grid.at(512, 64)]);
    constexpr double kStep = 10.0 / 128;  // errors are of second order in it
    EXPECT_NEAR(between, slab.middle, 0.2 * kStep * kStep * slab.middle) << slab.albedo;
    EXPECT_NEAR(4 * M_PI * exit.reflected[512], slab.R, 0.2 * kStep * kStep * slab.R) << slab.albedo;
    EXPECT_NEAR(4 * M_PI * exit.transmitted[512], slab.T, 0.2 * kStep * kStep * slab.T) << slab.albedo;
  }
}

// Without absorption and a source at the boundary's far side, light falls off as exp(-k depth) with k^2 =
// 3 (1 - albedo)(1 - albedo g) in the corrected form and a third of that as printed (theory: kappa = 3 D).
TEST(PlaneEquation, PrintedFormDecaysTooSlowly) {
  const PlaneMedium m = layerMedium(1024, 128, 20, 0.9, 0, 0, 1024);
  for (const PlaneForm form : {PlaneForm::kCorrected, PlaneForm::kPrinted}) {
    PlaneField I0;
    VCycleSettings settings;
    settings.tolerance = 1e-8;
    solveByVCycles(formPlaneSystem(m, form), I0, settings);
    const double k = std::log(I0[m.grid.at(512, 64)] / I0[m.grid.at(512, 80)]) / (16 * 20.0 / 128);
    EXPECT_NEAR(k, form == PlaneForm::kCorrected ? 0.5477 : 0.3162, 0.003);
  }
}

}  // namespace
}  // namespace vdb_diffuse
