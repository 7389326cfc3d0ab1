#include "diffusion/source_shape.h"

#include <gtest/gtest.h>

#include <functional>

namespace vdb_diffuse {
namespace {

double integral(double from, double to, const std::function<double(double)>& f) {
  constexpr int kParts = 4000;  // midpoints
  double sum = 0;
  for (int n = 0; n < kParts; ++n) sum += f(from + (to - from) * (n + 0.5) / kParts);
  return sum * (to - from) / kParts;
}

TEST(SourceShape, DecayMomentsAreIntegrals) {
  for (double tau : {0.0, 1e-5, 0.3, 0.499, 0.501, 3.0, 30.0}) {
    const DecayMoments decay = decayMoments(tau);
    const auto exact = [&](int power) {
      return integral(0, 1, [&](double t) { return std::pow(t, power) * std::exp(-tau * t); });
    };
    const double midpoints = 1e-7 * (1 + tau * tau) * exact(0);
    EXPECT_NEAR(decay.m0, exact(0), midpoints) << tau;
    EXPECT_NEAR(decay.m1, exact(1), midpoints) << tau;
    EXPECT_NEAR(decay.m2, exact(2), midpoints) << tau;
  }
}

TEST(SourceShape, LeanIsTheBeamsFirstMoment) {
  for (double tau : {1e-5, 0.0099, 0.0101, 1.0, 7.0, 30.0}) {
    const auto beam = [&](double x) { return std::exp(-tau * (x + 0.5)); };
    const double moment =
        integral(-0.5, 0.5, [&](double x) { return x * beam(x); }) / integral(-0.5, 0.5, beam);
    EXPECT_NEAR(beamLean(tau), moment, 1e-6) << tau;
    EXPECT_NEAR(beamLean(-tau), -moment, 1e-6) << tau;
  }
}

}  // namespace
}  // namespace vdb_diffuse
