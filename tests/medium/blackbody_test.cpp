#include "medium/blackbody.h"

#include <gtest/gtest.h>

#include <cmath>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

// Until 1979 the candela was defined by it: a black body at the freezing point of platinum, 2042.15 K on
// the scale of 1968, has 60 cd/cm^2.
TEST(Blackbody, ShinesAsTheOldCandelaAtTheFreezingPointOfPlatinum) {
  constexpr double kFit = 0.02;  // of the responses, in this red light
  EXPECT_NEAR(683 * blackbodyXyz(2042.15)[1], 60e4, kFit * 60e4);
}

// CIE 15: illuminant A is a black body of 2855.54 K (with c2 = 0.014388 m K); the others lie on the
// published Planckian locus (Wyszecki and Stiles, table 1(3.11)).
TEST(Blackbody, HasTheChromaticityOfThePlanckianLocus) {
  const struct {
    double kelvin, x, y;
  } known[] = {{2855.54, 0.44757, 0.40745}, {6500, 0.3135, 0.3237}, {10000, 0.2807, 0.2884}};
  for (const auto& k : known) {
    const Vec3d xyz = blackbodyXyz(k.kelvin);
    const double sum = xyz[0] + xyz[1] + xyz[2];
    EXPECT_NEAR(xyz[0] / sum, k.x, 0.003) << k.kelvin;
    EXPECT_NEAR(xyz[1] / sum, k.y, 0.003) << k.kelvin;
  }
}

// Far beyond the visible the radiance is that of Rayleigh and Jeans, 2 c k T / lambda^4.
TEST(Blackbody, GrowsInProportionWhereItIsHot) {
  EXPECT_NEAR(blackbodyXyz(1e6)[1] / blackbodyXyz(5e5)[1], 2, 0.03);
  EXPECT_EQ(blackbodyXyz(0), Vec3d(0));
}

TEST(Blackbody, ColourIsNeverNegativeAndKeepsTheLuminance) {
  for (double kelvin : {600., 1000., 1500., 1900., 3000., 6500., 20000., 1e6}) {
    const Vec3d rgb = blackbodyRgb(kelvin);
    const double Y = blackbodyXyz(kelvin)[1];
    for (int c = 0; c < 3; ++c) EXPECT_GE(rgb[c], 0) << kelvin;
    EXPECT_NEAR(0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2], Y, 1e-3 * Y) << kelvin;
  }
  const Vec3d red = blackbodyRgb(1500), white = blackbodyRgb(6500), blue = blackbodyRgb(20000);
  EXPECT_EQ(red[2], 0);
  EXPECT_GT(red[0], 2 * red[1]);
  EXPECT_NEAR(white[0] / white[1], 1, 0.1);
  EXPECT_NEAR(white[2] / white[1], 1, 0.1);
  EXPECT_GT(blue[2], blue[1]);
  EXPECT_GT(blue[1], blue[0]);
}

TEST(BlackbodyField, IsTheColourOfEveryVoxelsTemperature) {
  Field<float> temperature(1);
  for (int n = 0; n < kBlockVoxels; ++n) temperature[n] = static_cast<float>(20.0 * n / kBlockVoxels);
  const Channels Q = blackbodyField(temperature, 200, 3);
  ASSERT_EQ(Q.size(), 3u);
  EXPECT_EQ(Q[0][0], 0);
  for (int n = 0; n < kBlockVoxels; ++n) {
    const double T = temperature[n] * 200.0;
    if (T < 500) continue;
    const Vec3d rgb = blackbodyRgb(T);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(Q[c][n], 3 * rgb[c], 3e-4 * 3 * rgb.length()) << T;
  }
}

TEST(BlackbodyField, ColdIsBlackAndTooHotIsRefused) {
  Field<float> temperature(1, 1);
  for (const Field<float>& channel : blackbodyField(temperature, 300, 1)) EXPECT_EQ(channel[0], 0);
  for (const Field<float>& channel : blackbodyField(temperature, 0, 1)) EXPECT_EQ(channel[0], 0);
  EXPECT_GT(blackbodyField(temperature, kHottest, 1)[0][0], 0);
  EXPECT_THROW(blackbodyField(temperature, 1.01 * kHottest, 1), InputError);
}

}  // namespace
}  // namespace vdb_diffuse
