#include "medium/attenuation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace vdb_diffuse {
namespace {

constexpr float kEpsilon = std::numeric_limits<float>::epsilon();

struct Exact {
  long double e, m, n;
};

Exact exactAttenuation(long double tau) {
  if (tau == 0) return {1, 1, 0.5L};
  const long double e = std::exp(-tau), m = -std::expm1(-tau) / tau;
  if (tau > 0.1L) return {e, m, (1 - m) / tau};
  long double n = 0, term = 0.5L;  // 1/2! - tau/3! + tau^2/4! ..., a dozen terms to 1e-19 below 0.1
  for (int k = 3; k < 16; ++k) {
    n += term;
    term *= -tau / k;
  }
  return {e, m, n};
}

TEST(Attenuation, MatchesLongDoubleFromZeroToOpaque) {
  std::vector<float> taus{0, 0.7f, std::nextafter(0.7f, 0.0f), 87, std::nextafter(87.0f, 0.0f), 88, 1e9f};
  for (float tau = 1e-9f; tau < 1e9f; tau *= 1.013f) taus.push_back(tau);
  for (float tau = 0.5f; tau < 0.9f; tau += 1e-4f) taus.push_back(tau);  // where the series gives over
  for (float tau : taus) {
    const Attenuation light = attenuationOf(Row{} + tau);
    const Exact exact = exactAttenuation(tau);
    // e is told to 2e-7; the argument's own reduction adds half a rounding of tau, until e is gone. Each of m
    // and n is a quotient of a difference that has lost at most two bits.
    const double of_e = tau < 87 ? 2e-7 * (1 + 0.01 * tau) * static_cast<double>(exact.e) : 2e-38;
    for (int lane = 0; lane < 8; ++lane) {
      EXPECT_NEAR(light.e[lane], static_cast<double>(exact.e), of_e) << tau;
      EXPECT_NEAR(light.m[lane] / static_cast<double>(exact.m), 1, 4 * kEpsilon) << tau;
      EXPECT_NEAR(light.n[lane] / static_cast<double>(exact.n), 1, 8 * kEpsilon) << tau;
    }
  }
}

// What enters a segment and what starts on it leaves or is lost on it: with J0 = psi nothing changes, and
// with a source dJ the light that leaves differs from the source's end by what is still to come.
TEST(Attenuation, LightInBalanceStaysAsItIs) {
  for (float tau : {0.0f, 1e-6f, 0.1f, 0.69f, 0.71f, 3.0f, 50.0f, 1e6f}) {
    const Attenuation a = attenuationOf(Row{} + tau);
    EXPECT_NEAR(a.e[0] + (1 - a.e[0]), 1, kEpsilon);
    EXPECT_NEAR(a.e[0], 1 - tau * a.m[0], 4 * kEpsilon) << tau;  // what is lost is tau times the mean
    EXPECT_NEAR(a.m[0], 1 - tau * a.n[0], 4 * kEpsilon) << tau;  // and once more
    EXPECT_LE(a.e[0], a.m[0]);
    EXPECT_LE(a.n[0], 0.5f);
  }
}

}  // namespace
}  // namespace vdb_diffuse
