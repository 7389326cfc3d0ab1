#include "diffusion/voxel_profile.h"

#include <gtest/gtest.h>

#include <functional>

namespace vdb_diffuse {
namespace {

double mean(const std::function<double(double)>& f) {
  constexpr int kParts = 4000;
  double sum = 0;
  for (int n = 0; n < kParts; ++n) sum += f((n + 0.5) / kParts - 0.5);
  return sum / kParts;
}

struct Voxel {
  double r, tau_a;
  double decay() const { return std::sqrt(2 * r * tau_a); }
};
const Voxel kVoxels[] = {{1, 0}, {3, 1e-5}, {0.5, 0.000999}, {0.5, 0.001001}, {1.5, 0.1}, {15, 0.1}, {6, 2}};

// Light without sources is A cosh(kx) + B sinh(kx), its flux -I0'/(2r).
TEST(VoxelProfile, IsExactWithoutSources) {
  for (const Voxel& voxel : kVoxels)
    for (double A : {0.0, 1.0})
      for (double B : {-1.0, 2.0}) {
        const double k = voxel.decay();
        const auto I0 = [&](double x) {
          return k > 0 ? A * std::cosh(k * x) + B * std::sinh(k * x) : A + B * x;
        };
        const auto flux = [&](double x) {
          return -(k > 0 ? k * (A * std::sinh(k * x) + B * std::cosh(k * x)) : B) / (2 * voxel.r);
        };
        const VoxelProfile p = voxelProfile(voxel.r, voxel.tau_a);
        const double size = std::abs(I0(0.5)) + std::abs(I0(-0.5));
        EXPECT_NEAR(p.a * mean(I0) - voxel.r * p.odd * flux(0.5), I0(0.5), 1e-6 * size) << k;
        EXPECT_NEAR(p.a * mean(I0) + voxel.r * p.odd * flux(-0.5), I0(-0.5), 1e-6 * size) << k;
        const double slope = 12 * mean([&](double x) { return x * I0(x); });
        EXPECT_NEAR(-voxel.r * p.slope * (flux(0.5) + flux(-0.5)), slope, 1e-5 * size) << k;
      }
}

/// I0 on the upper face less what the mean and the flux through it say, for I0 = 0 and no flux below: what a
/// source adds. By Simpson-like marching of -I0''/(2r) + tau_a I0 = S from the lower face.
double headOf(const Voxel& voxel, const std::function<double(double)>& S) {
  constexpr int kSteps = 20000;
  const double h = 1.0 / kSteps;
  double I0 = 0, slope = 0, sum = 0;
  for (int n = 0; n < kSteps; ++n) {  // midpoint rule
    const double x = -0.5 + n * h, bend = 2 * voxel.r * (voxel.tau_a * I0 - S(x));
    const double I0_middle = I0 + 0.5 * h * slope, slope_middle = slope + 0.5 * h * bend;
    sum += h * I0_middle;
    slope += h * 2 * voxel.r * (voxel.tau_a * I0_middle - S(x + 0.5 * h));
    I0 += h * slope_middle;
  }
  const VoxelProfile p = voxelProfile(voxel.r, voxel.tau_a);
  return I0 - (p.a * sum + voxel.r * p.odd * slope / (2 * voxel.r));
}

TEST(VoxelProfile, SourcesLiftTheFace) {
  const std::function<double(double)> sources[] = {
      [](double) { return 1.0; }, [](double x) { return 1 + 2 * x; },
      [](double x) { return std::exp(-4 * (x + 0.5)); }, [](double x) { return x * x; }};
  for (const Voxel& voxel : kVoxels)
    for (const auto& S : sources) {
      const double S0 = mean(S), S1 = mean([&](double x) { return x * S(x); });
      const double S2 = mean([&](double x) { return (x * x - 1. / 12) * S(x); });
      const VoxelProfile p = voxelProfile(voxel.r, voxel.tau_a);
      const double head = voxel.r * (p.even * S0 + p.lean * S1 + p.spread * S2), exact = headOf(voxel, S);
      const double parabola =
          0.05 * std::min(1.0, voxel.decay() * voxel.decay());  // for a weight that is none
      EXPECT_NEAR(head, exact, (1e-3 + parabola) * voxel.r * S0) << voxel.decay();
      for (double x = -0.5; x <= 0.5; x += 0.0625)
        EXPECT_GE(p.even + p.lean * x + p.spread * (x * x - 1. / 12), -1e-3) << voxel.decay() << " at " << x;
    }
}

TEST(VoxelProfile, ThickestVoxelsAreFinite) {
  for (double tau_a : {1e3, 1e12, 1e30}) {
    const VoxelProfile p = voxelProfile(1.5 * tau_a, tau_a);
    EXPECT_GT(p.a, 0);
    EXPECT_TRUE(std::isfinite(tau_a / p.a));
    // a source that is even stays where it is: the face has I0 = S / tau_a
    EXPECT_NEAR(p.a / tau_a + p.r * p.even, 1 / tau_a, 1e-9 / tau_a);
  }
}

}  // namespace
}  // namespace vdb_diffuse
