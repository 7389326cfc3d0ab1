#include "plot/ticks.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vdb_diffuse {
namespace {

std::vector<std::string> labelsOf(const std::vector<Tick>& ticks) {
  std::vector<std::string> labels;
  for (const Tick& tick : ticks)
    if (!tick.label.empty()) labels.push_back(tick.label);
  return labels;
}

using Labels = std::vector<std::string>;

TEST(Ticks, LinearOnesAreRoundAndNoneIsLost) {
  EXPECT_EQ(labelsOf(ticksOf(Scale::kLinear, 0, 1, 6)), (Labels{"0", "0.2", "0.4", "0.6", "0.8", "1.0"}));
  EXPECT_EQ(labelsOf(ticksOf(Scale::kLinear, -0.3, 0.3, 7)),
            (Labels{"-0.3", "-0.2", "-0.1", "0", "0.1", "0.2", "0.3"}));
  EXPECT_EQ(labelsOf(ticksOf(Scale::kLinear, 7, 46, 5)), (Labels{"10", "20", "30", "40"}));
  EXPECT_EQ(labelsOf(ticksOf(Scale::kLinear, 0, 3e-7, 4)), (Labels{"0", "10⁻⁷", "2·10⁻⁷", "3·10⁻⁷"}));
}

TEST(Ticks, LogarithmicOnesArePowersOfTenAndTheDigitsThatFit) {
  EXPECT_EQ(labelsOf(ticksOf(Scale::kLog, 0.01, 100, 6)), (Labels{"0.01", "0.1", "1", "10", "100"}));
  EXPECT_EQ(labelsOf(ticksOf(Scale::kLog, 0.8, 60, 6)), (Labels{"1", "2", "5", "10", "20", "50"}));
  EXPECT_EQ(labelsOf(ticksOf(Scale::kLog, 1e-9, 1e9, 7)),
            (Labels{"10⁻⁹", "10⁻⁶", "0.001", "1", "1000", "10⁶", "10⁹"}));
  EXPECT_EQ(labelsOf(ticksOf(Scale::kLog, 3.1, 3.6, 7)), (Labels{"3.1", "3.2", "3.3", "3.4", "3.5", "3.6"}));
}

// Whatever the range: as many as fit, not fewer than two, ascending and inside.
TEST(Ticks, KeepToTheirAxis) {
  for (const Scale scale : {Scale::kLinear, Scale::kLog})
    for (double low = 1.7e-8; low < 1e8; low *= 7.3)
      for (const double ratio : {1.13, 1.9, 8.0, 70.0, 9e4, 3e12})
        for (const int most : {4, 7, 12}) {
          const std::vector<Tick> ticks = ticksOf(scale, low, low * ratio, most);
          const size_t count = labelsOf(ticks).size();
          EXPECT_GE(count, 2u) << low << " x " << ratio;
          EXPECT_LE(count, static_cast<size_t>(most)) << low << " x " << ratio;
          const double slack = 1e-6 * (scale == Scale::kLog ? low : low * ratio);
          EXPECT_GE(ticks.front().value, low - slack);
          EXPECT_LE(ticks.back().value, low * ratio * (1 + 1e-6));
          for (size_t i = 1; i < ticks.size(); ++i) EXPECT_GT(ticks[i].value, ticks[i - 1].value);
          for (size_t i = 1; i < count; ++i) EXPECT_NE(labelsOf(ticks)[i], labelsOf(ticks)[i - 1]);
        }
}

}  // namespace
}  // namespace vdb_diffuse
