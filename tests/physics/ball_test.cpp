#include <gtest/gtest.h>

#include "diffusion/diffuse.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

// A homogeneous ball of radius R that glows with Q = 1: the diffusion equation and the Marshak condition have
// the solution J = 1 - A sinh(kr)/(kr), k^2 = sigma_a / D.
constexpr double kRadius = 5, kSigmaS = 1, kSigmaA = 0.1;

double exactJ(double r) {
  const double D = 1 / (3 * (kSigmaS + kSigmaA)), k = std::sqrt(kSigmaA / D), kR = k * kRadius;
  const double A =
      1 / (std::sinh(kR) / kR + 2 * D * (std::cosh(kR) / kRadius - std::sinh(kR) / (kR * kRadius)));
  return 1 - A * (r > 0 ? std::sinh(k * r) / (k * r) : 1);
}

struct BallError {
  double mean;   // relative error of the mean over the ball
  double shell;  // largest of those of ten shells of equal thickness
};

BallError ballError(int voxels_per_radius, Model model) {
  const double h = kRadius / voxels_per_radius;
  Medium medium = ballMedium(kRadius, h);
  medium.optics.sigma_s = Vec3d(kSigmaS);
  medium.optics.sigma_a = Vec3d(kSigmaA);
  setEmission(medium, [](Coord) { return 1.0; });
  DiffuseSettings settings;
  settings.model = {model, std::numeric_limits<double>::infinity()};
  settings.tolerance = 1e-6;
  const DiffuseResult result = diffuse(medium, {}, settings);
  EXPECT_TRUE(result.converged);

  double J[10] = {}, exact[10] = {}, sum_J = 0, sum_exact = 0;
  const double middle = 0.5 * (2 * (voxels_per_radius + 2) - 1);
  forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
    const double r = (p.asVec3d() - Vec3d(middle)).length() * h;
    const int shell = std::min(9, static_cast<int>(10 * r / kRadius));
    J[shell] += result.diffuse[0][i];
    exact[shell] += exactJ(r);
    sum_J += result.diffuse[0][i];
    sum_exact += exactJ(r);
  });
  BallError error{sum_J / sum_exact - 1, 0};
  for (int s = 0; s < 10; ++s) error.shell = std::max(error.shell, std::abs(J[s] / exact[s] - 1));
  return error;
}

TEST(Ball, ClosedFormIsTheTabulatedOne) {
  const double table[] = {0.734773, 0.711385, 0.633724, 0.476425, 0.186449};
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(exactJ(kRadius * i / 4), table[i], 1e-6);
}

TEST(Ball, AreaFactorCuresTheStaircase) {
  const BallError coarse = ballError(10, Model::kDefault), fine = ballError(20, Model::kDefault),
                  finest = ballError(40, Model::kDefault), plain = ballError(20, Model::kP1),
                  plain_finest = ballError(40, Model::kP1);
  ::testing::Message errors;
  errors << "R/h 10, 20, 40: mean " << coarse.mean << ", " << fine.mean << ", " << finest.mean << "; shells "
         << coarse.shell << ", " << fine.shell << ", " << finest.shell
         << "; without the factor at 20, 40: mean " << plain.mean << ", " << plain_finest.mean << "; shells "
         << plain.shell << ", " << plain_finest.shell;
  for (const BallError& error : {fine, finest}) {
    EXPECT_LT(std::abs(error.mean), 0.03) << errors;
    EXPECT_LT(error.shell, 0.03) << errors;
  }
  // The steps have 1.5 times the ball's area at any voxel size, so that too much leaks however fine they are.
  EXPECT_LT(plain.mean, -0.05) << errors;
  EXPECT_LT(plain_finest.mean, -0.05) << errors;
  EXPECT_GT(plain_finest.shell, 5 * finest.shell) << errors;
  RecordProperty("errors", errors.GetString());
}

}  // namespace
}  // namespace vdb_diffuse
