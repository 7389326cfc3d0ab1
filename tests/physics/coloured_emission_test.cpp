#include <gtest/gtest.h>

#include "reference/path_tracer.h"
#include "transport/illuminate.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

// A medium that glows red below and blue above, and a little green everywhere. Colours do not mix in a grey
// medium: each is what it would be alone.

double glowOf(int channel, const Coord& p) {
  return channel == 0 ? (p[2] < 6 ? 2 + hashed(p) : 0) : channel == 1 ? 0.3 : (p[2] < 6 ? 0 : 1);
}

Medium glowing(double g) {
  Medium medium =
      boxMedium(Coord(11, 10, 12), Transform::uniform(0.3), [](Coord p) { return lumpyDensity(p); });
  medium.optics.sigma_s = Vec3d(1.2);
  medium.optics.sigma_a = Vec3d(0.4);
  medium.optics.g = g;
  medium.optics.emission_scale = 1.5;
  return medium;
}

Medium withChannel(Medium medium, int channel) {
  setEmission(medium, [&](Coord p) { return glowOf(channel, p); });
  return medium;
}

Medium withAll(Medium medium) {
  Channels emission;
  for (int c = 0; c < 3; ++c) emission.push_back(withChannel(medium, c).emission[0]);
  medium.emission = std::move(emission);
  return medium;
}

TEST(ColouredEmission, EachColourOfABakeIsThatColourAlone) {
  for (const double g : {0.0, 0.5})
    for (const int sweeps : {0, 2}) {
      const Medium medium = glowing(g);
      DiffuseSettings settings;
      settings.tolerance = 1e-6;
      TransportSettings transport;
      transport.sweeps = sweeps;
      const Scene sun = sunScene(Vec3d(0, 0.3, -1));
      const DiffuseResult all = illuminate(withAll(medium), sun, settings, transport);
      ASSERT_EQ(all.diffuse.size(), 3u);
      for (int c = 0; c < 3; ++c) {
        const DiffuseResult one = illuminate(withChannel(medium, c), sun, settings, transport);
        EXPECT_LT(largestDifference(medium.topology(), all.diffuse[c], one.diffuse[0]), 1e-4)
            << "g " << g << ", sweeps " << sweeps << ", channel " << c;
      }
      const Channels source = sourceField(withAll(medium), all.direct);
      ASSERT_EQ(source.size(), 3u);
      const Field<float> blue = sourceField(withChannel(medium, 2), {all.direct[2]})[0];
      EXPECT_LT(largestDifference(medium.topology(), source[2], blue), 1e-6);
    }
}

TEST(ColouredEmission, EachColourOfTheReferenceIsThatColourAlone) {
  const Medium medium = glowing(0.5);
  ReferenceSettings settings;
  settings.samples = 1 << 18;
  const ReferenceResult all = reference(withAll(medium), {}, settings);
  ASSERT_EQ(all.diffuse.size(), 3u);
  EXPECT_LT(std::abs(all.energy.closure()), 1e-6);
  settings.seed = 2;
  for (int c = 0; c < 3; ++c) {
    const ReferenceResult one = reference(withChannel(medium, c), {}, settings);
    double excess = 0, spread = 0, beyond = 0;
    forEachVoxel(medium.topology(), [&](Coord, size_t i) {
      const double variance = std::pow(all.diffuse_se[c][i], 2) + std::pow(one.diffuse_se[0][i], 2);
      const double d = all.diffuse[c][i] - one.diffuse[0][i];
      excess += d * d;
      spread += variance;
      beyond += d * d > 25 * variance;
    });
    EXPECT_LT(excess, 1.5 * spread) << "channel " << c;
    EXPECT_GT(excess, 0.5 * spread) << "channel " << c;
    EXPECT_LE(beyond, 1) << "channel " << c << ": voxels beyond five standard errors";
  }
}

}  // namespace
}  // namespace vdb_diffuse
