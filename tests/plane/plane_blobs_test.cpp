#include "plane/plane_blobs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "plane/v_cycle.h"

namespace vdb_diffuse {
namespace {

struct Cloud {
  std::vector<PlaneBlob> blobs = scatterBlobs(30, 1, 3);
  PlaneMedium medium;
  PlaneSystem system;

  Cloud() {
    medium.grid = {64, 64, 1.0 / 64};
    medium.rho = densityOf(blobs, medium.grid);
    medium.sigma_s = 8;
    medium.sigma_a = 2;
    medium.irradiance.assign(64, 1.0);
    system = formPlaneSystem(medium, PlaneForm::kCorrected, 0.3);
  }
};

TEST(PlaneBlobs, BasisAddsUpToOneWhereThereIsDensity) {
  const Cloud cloud;
  const PlaneBasis basis = planeBasis(cloud.blobs, cloud.medium);
  const PlaneField sum = evaluateBlobs(basis, std::vector<double>(cloud.blobs.size(), 1.0));
  for (size_t c = 0; c < sum.size(); ++c) EXPECT_NEAR(sum[c], cloud.medium.rho[c] > 0 ? 1 : 0, 1e-12);
}

// An even light whose source is what is absorbed of it.
TEST(PlaneBlobs, CollocationFindsAnEvenLight) {
  Cloud cloud;
  cloud.system.b = cloud.system.A.sink;
  const PlaneBlobSolution solution =
      solvePlaneBlobs(cloud.blobs, cloud.medium, cloud.system, PlaneBlobForm::kCollocation);
  for (const double I : solution.I) EXPECT_NEAR(I, 1, 1e-6);
}

// The psi add up to one, so that the rows of the system add up to the balance of energy.
TEST(PlaneBlobs, GalerkinConservesEnergy) {
  const Cloud cloud;
  const PlaneBlobSolution solution =
      solvePlaneBlobs(cloud.blobs, cloud.medium, cloud.system, PlaneBlobForm::kGalerkin);
  const PlaneField I = evaluateBlobs(planeBasis(cloud.blobs, cloud.medium), solution.I);
  const PlaneGrid& grid = cloud.medium.grid;
  double in = 0, out = 0;
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const size_t c = grid.at(i, j);
      if (!(cloud.medium.rho[c] > 0)) continue;
      in += cloud.system.b[c];
      out += cloud.system.A.sink[c] * I[c];
      const auto inside = [&](int p, int q) {
        return p >= 0 && q >= 0 && p < grid.nx && q < grid.ny && cloud.medium.rho[grid.at(p, q)] > 0;
      };
      for (const bool open : {!inside(i - 1, j), !inside(i + 1, j), !inside(i, j - 1), !inside(i, j + 1)})
        if (open) out += cloud.system.A.boundary(c) * I[c];
    }
  EXPECT_NEAR(out / in, 1, 1e-9);
}

TEST(PlaneBlobs, GalerkinComesNearToTheGrid) {
  const Cloud cloud;
  PlaneField grid;
  solveByVCycles(cloud.system, grid);
  const std::vector<PlaneBlob> basis = widened(cloud.blobs, 1.5);
  const PlaneBlobSolution solution =
      solvePlaneBlobs(basis, cloud.medium, cloud.system, PlaneBlobForm::kGalerkin);
  const PlaneField I = evaluateBlobs(planeBasis(basis, cloud.medium), solution.I);
  EXPECT_LT(relativeRms(I, grid, cloud.medium.rho), 0.3);
}

}  // namespace
}  // namespace vdb_diffuse
