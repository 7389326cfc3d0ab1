#include "report/error_curve.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vdb_diffuse {
namespace {

/// Points of error = c / sqrt(seconds).
std::vector<CurvePoint> law(double c, std::initializer_list<double> seconds) {
  std::vector<CurvePoint> curve;
  for (const double s : seconds) curve.push_back({s, c / std::sqrt(s)});
  return curve;
}

TEST(ErrorCurve, OnTheLawEveryErrorTakesTheSecondsOfTheLaw) {
  const std::vector<CurvePoint> curve = law(0.3, {0.5, 1, 7, 30});
  EXPECT_NEAR(lawOf(curve), 0.3, 1e-12);
  for (const double error : {0.9, 0.31, 0.2, 0.11, 0.06, 0.01}) {
    const auto equal = secondsForError(curve, error);
    ASSERT_TRUE(equal);
    EXPECT_NEAR(equal->seconds, 0.09 / (error * error), 1e-9 * equal->seconds) << error;
    EXPECT_EQ(equal->extrapolated, error > 0.3 / std::sqrt(0.5) || error < 0.3 / std::sqrt(30)) << error;
  }
}

TEST(ErrorCurve, IsStraightOnLogarithmicAxesBetweenPoints) {
  const auto equal = secondsForError({{1, 0.4}, {100, 0.1}}, 0.2);  // half way in both
  ASSERT_TRUE(equal);
  EXPECT_NEAR(equal->seconds, 10, 1e-9);
  EXPECT_FALSE(equal->extrapolated);
  EXPECT_EQ(secondsForError({{1, 0.4}, {100, 0.1}}, 0.1)->seconds, 100);
  EXPECT_EQ(secondsForError({{1, 0.4}, {100, 0.1}}, 0.4)->seconds, 1);
}

// Noise may let a curve dip: what counts is when it stays below.
TEST(ErrorCurve, TakesTheLastDescent) {
  const auto equal = secondsForError({{1, 0.4}, {4, 0.1}, {16, 0.2}, {64, 0.05}}, 0.1);
  ASSERT_TRUE(equal);
  EXPECT_NEAR(equal->seconds, 32, 1e-9);
}

TEST(ErrorCurve, KnowsWhereThereIsNoAnswer) {
  EXPECT_FALSE(secondsForError({}, 0.1));
  EXPECT_FALSE(secondsForError({{1, 0.4}}, 0));
  EXPECT_FALSE(secondsForError({{1, 0.4}}, NAN));
  EXPECT_EQ(lawOf({}), 0);
}

}  // namespace
}  // namespace vdb_diffuse
