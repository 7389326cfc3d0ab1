#include <gtest/gtest.h>

#include "reference/random.h"

namespace vdb_diffuse {
namespace {

// Stam (1995), appendix A: scattering multiplies the l-th angular moment of light by p_l/(4 pi), so that n
// scatterings leave (p_l/(4 pi))^n of it and light forgets where it came from. For the phase function of
// Henyey and Greenstein p_l = 4 pi g^l (the paper prints p_1 = 2 pi mu_bar/3, which is 2 pi g).

double legendre(int l, double x) {
  double before = 1, now = x;
  if (l == 0) return 1;
  for (int n = 1; n < l; ++n) {
    const double next = ((2 * n + 1) * x * now - n * before) / (n + 1);
    before = now;
    now = next;
  }
  return now;
}

double phase(double g, double cosine) {
  return (1 - g * g) / std::pow(1 + g * g - 2 * g * cosine, 1.5);
}

// p_l/(4 pi) is half the integral of p P_l over the cosine.
TEST(AngularSmoothing, MomentsOfThePhaseFunctionArePowersOfG) {
  constexpr int kSteps = 200000;
  for (const double g : {0.0, 0.3, -0.5, 0.85})
    for (int l = 0; l <= 4; ++l) {
      double half = 0;
      for (int n = 0; n < kSteps; ++n) {
        const double cosine = -1 + (n + 0.5) * 2 / kSteps;
        half += phase(g, cosine) * legendre(l, cosine) / kSteps;
      }
      EXPECT_NEAR(half, std::pow(g, l), 1e-5) << "g " << g << ", l " << l;
    }
}

// A million paths of the referee, all sent along z: the moments of their directions after n scatterings over
// the zeroth, which is one. The standard error of a mean of P_l is below 1/sqrt(paths).
TEST(AngularSmoothing, MomentsFallAsTheSpectrumToTheOrderOfScattering) {
  constexpr int kPaths = 1000000, kOrders = 6, kMoments = 4;
  for (const double g : {0.85, -0.4}) {
    double sum[kOrders + 1][kMoments + 1] = {};
    for (int path = 0; path < kPaths; ++path) {
      RandomStream random(7, 0, path);
      Vec3f direction(0, 0, 1);
      for (int n = 0; n <= kOrders; ++n) {
        for (int l = 0; l <= kMoments; ++l) sum[n][l] += legendre(l, direction[2]);
        direction = deflected(direction, g, random);
      }
    }
    for (int n = 0; n <= kOrders; ++n)
      for (int l = 0; l <= kMoments; ++l)
        EXPECT_NEAR(sum[n][l] / sum[n][0], std::pow(g, l * n), 4 / std::sqrt(kPaths))
            << "g " << g << ", l " << l << ", after " << n << " scatterings";
  }
}

}  // namespace
}  // namespace vdb_diffuse
