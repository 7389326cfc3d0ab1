#include <gtest/gtest.h>

#include <algorithm>

#include "paper/beam.h"
#include "paper/part.h"

namespace vdb_diffuse {
namespace {

const Claim& claimWith(const PaperResult& result, const std::string& words) {
  const auto found = std::find_if(result.claims.begin(), result.claims.end(),
                                  [&](const Claim& c) { return c.words.find(words) != std::string::npos; });
  EXPECT_NE(found, result.claims.end()) << words;
  return *found;
}

// Exact where nothing is absorbed; as printed it forgets the albedo, half the light in an opaque slab.
TEST(Paper, CompositingIsExactInAConstantSlab) {
  const PaperResult result = compositing({});
  EXPECT_LT(claimWith(result, "albedo 1").measured, 1e-4);
  EXPECT_NEAR(claimWith(result, "albedo 0.5").measured, 0.5 * 0.4, 1e-3);
  EXPECT_LT(claimWith(result, "before I").measured, 1e-4);
}

// The coefficient is 4 pi g, twice what is printed.
TEST(Paper, SmoothingIsByPowersOfG) {
  const PaperResult result = angularSmoothing({});
  EXPECT_EQ(claimWith(result, "n scatterings").verdict(), Verdict::kHolds);
  const Claim& p1 = claimWith(result, "p_1");
  EXPECT_NEAR(p1.measured / p1.promised, 2, 0.01);
  EXPECT_EQ(p1.verdict(), Verdict::kDoesNotHold);
}

TEST(Paper, PrintedBeamIsWorseThanTheCorrectedOne) {
  PaperSettings settings;
  settings.effort = 0.05;
  const BeamLight light = lightOfBeam({0.99, 20, 0}, settings);
  EXPECT_LT(light.corrected_error, 0.12);
  EXPECT_GT(light.printed_error, 3 * light.corrected_error);
}

}  // namespace
}  // namespace vdb_diffuse
