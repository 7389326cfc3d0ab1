#include "diffusion/source_shape.h"

#include <gtest/gtest.h>

#include <functional>

namespace vdb_diffuse {
namespace {

double integral(double from, double to, const std::function<double(double)>& f) {
  constexpr int kParts = 2000;  // midpoints
  double sum = 0;
  for (int n = 0; n < kParts; ++n) sum += f(from + (to - from) * (n + 0.5) / kParts);
  return sum * (to - from) / kParts;
}

/// What a beam that travels up scatters in a voxel, exp(-tau x) with the mean 1.
std::function<double(double)> beam(double tau) {
  const double mean = tau == 0 ? 1 : 2 * std::sinh(0.5 * tau) / tau;
  return [=](double x) { return std::exp(-tau * x) / mean; };
}

const double kDepths[] = {0, 1e-5, 0.0099, 0.011, 0.049, 0.051, 1, 7, 30};

TEST(SourceShape, SlopeHasTheBeamsFirstMoment) {
  for (double tau : kDepths) {
    const auto f = beam(tau);
    const double moment = integral(-0.5, 0.5, [&](double x) { return x * f(x); });
    EXPECT_NEAR(beamSlope(tau) / 12, moment, 1e-6 + 1e-5 * std::abs(moment)) << tau;
  }
}

TEST(SourceShape, AheadIsHalfTheDifferenceOfTheHalves) {
  for (double tau : kDepths) {
    const auto f = beam(tau);
    const double up = integral(0, 0.5, [&](double x) { return x * f(x); });
    const double down = integral(0, 0.5, [&](double x) { return x * f(-x); });
    EXPECT_NEAR(beamAhead(tau), 0.5 * (up - down), 1e-6) << tau;
  }
}

// I'' = -S with S the beam, I = 0 on both faces: twelve times the first moment of I is what the line between
// the faces lacks.
TEST(SourceShape, BendIsTheMomentOfWhatTheSourceLifts) {
  for (double tau : {0.049, 0.051, 1.0, 7.0}) {
    const auto f = beam(tau);
    const auto lifted = [&](double x) {  // by the Green's function of the interval
      return integral(-0.5, 0.5,
                      [&](double y) { return (std::min(x, y) + 0.5) * (0.5 - std::max(x, y)) * f(y); });
    };
    constexpr int kParts = 200;
    double moment = 0;
    for (int n = 0; n < kParts; ++n) {
      const double x = -0.5 + (n + 0.5) / kParts;
      moment += x * lifted(x) / kParts;
    }
    EXPECT_NEAR(beamBend(tau), 12 * moment, 1e-4 * std::abs(beamBend(tau)) + 1e-6) << tau;
  }
}

}  // namespace
}  // namespace vdb_diffuse
