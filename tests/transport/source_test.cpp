#include "transport/source.h"

#include <gtest/gtest.h>

#include "channel.h"
#include "transport/voxel_slopes.h"

namespace vdb_diffuse {
namespace {

void formSource(const ChannelSolution& channel, const Medium& medium, const std::vector<Field<float>>& second,
                SweepSource& source) {
  VectorField slope;
  formSweepSource(channel, medium, VoxelSlopes(channel, medium).now(channel, medium, slope), second, source);
}

Medium box(double sigma_s, double sigma_a, double g, const Transform& transform = Transform::uniform(0.5)) {
  Medium medium = boxMedium(Coord(16, 16, 16), transform, [](Coord) { return 2.0; });
  medium.optics.sigma_s = Vec3d(sigma_s);
  medium.optics.sigma_a = Vec3d(sigma_a);
  medium.optics.g = g;
  return medium;
}

// J = albedo (Q0 + I0) + (1 - albedo) Q in the rescaled medium, its first moments p1 albedo (Q1_flux + F),
// its second p2 albedo (those of the beams and of the diffuse light), with the phase function's own p1 and
// p2.
TEST(TransportSource, IsWhatScattersAndWhatGlows) {
  Medium medium = box(0.8, 0.2, 0.6);
  setEmission(medium, [](Coord) { return 5.0; });
  medium.optics.emission_scale = 3;
  Channel light(std::move(medium));
  light.Q0.fill(2);
  for (int a = 0; a < 3; ++a) light.Q1_flux[a].fill(0.1f * static_cast<float>(a + 1));
  for (int k = 0; k < 5; ++k) light.Q2_moments[k].fill(0.2f * static_cast<float>(k - 1));
  // f = g^3 moves into the beam; what is left has p_l = (g^l - f) / (1 - f)
  const double g = 0.6, f = g * g * g, sigma_s = (1 - f) * 0.8, extinction = sigma_s + 0.2,
               albedo = sigma_s / extinction, p1 = (g - f) / (1 - f), p2 = (g * g - f) / (1 - f);
  for (double scale : {1.0, 0.25}) {
    ChannelSolution channel = light.solution(scale, [](Coord) { return 7.0; });
    for (int a = 0; a < 3; ++a) channel.flux[a].fill(static_cast<float>(0.3 * (a + 1) * scale));
    const std::vector<Field<float>> second(5,
                                           Field<float>(light.medium.topology(), static_cast<float>(scale)));
    SweepSource source;
    formSource(channel, light.medium, second, source);
    const size_t i = voxelOffset(3, 4, 5);
    EXPECT_NEAR(source.tau[i], extinction * 0.5 * 2, 1e-6);
    EXPECT_NEAR(source.J[i], scale * (albedo * 9 + (1 - albedo) * 15), 1e-5);
    ASSERT_EQ(source.angular.size(), static_cast<size_t>(kSecondOrder));
    for (int a = 0; a < 3; ++a)  // moments are of b_k = sqrt(3) s_k
      EXPECT_NEAR(source.angular[a][i], scale * p1 * albedo * std::sqrt(3.0) * 0.4 * (a + 1), 1e-6);
    for (int k = 0; k < 5; ++k)
      EXPECT_NEAR(source.angular[kFirstOrder + k][i], scale * p2 * albedo * (1 + 0.2 * (k - 1)), 1e-6);
  }
}

TEST(TransportSource, IsotropicScatteringHasNoLinearPart) {
  Channel light(box(1, 0.1, 0));
  SweepSource source;
  formSource(light.solution(1, [](Coord) { return 1.0; }), light.medium, {}, source);
  EXPECT_TRUE(source.angular.empty());
}

TEST(TransportSource, FollowsAStraightLineInTheInterior) {
  const Vec3d G(0.03, -0.02, 0.01);
  for (const Transform& transform :
       {Transform::uniform(0.5), Transform(Vec3d(0.5, 0, 0), Vec3d(0, 2, 0), Vec3d(0, 0, 1), Vec3d(0))}) {
    Channel light(box(0.9, 0, 0, transform));
    SweepSource source;
    formSource(light.solution(1, [&](Coord p) { return 2 + G.dot(p.asVec3d()); }), light.medium, {}, source);
    const Topology& topology = light.medium.topology();
    for (const Coord& p : {Coord(4, 5, 6), Coord(7, 8, 9)})
      for (int a = 0; a < 3; ++a) EXPECT_NEAR(source.slope[a].at(topology, p), G[a], 1e-6);
  }
}

// Also where a beam dies within a voxel: lights add up.
TEST(TransportSource, IsLinearInTheLight) {
  for (double g : {0.0, 0.8}) {
    Medium medium =
        boxMedium(Coord(20, 17, 19), Transform::uniform(0.5), [](Coord p) { return lumpyDensity(p); });
    medium.optics.sigma_s = Vec3d(20);
    medium.optics.g = g;
    Channel light(std::move(medium));
    light.shape.emplace();
    for (VectorField* moments : {&light.shape->lean, &light.shape->spread})
      for (Field<float>& component : *moments) component = Field<float>(light.medium.topology());
    const auto sourceOf = [&](double down, double up) {
      forEachVoxel(light.medium.topology(), [&](Coord p, size_t i) {
        const double falling = down * std::exp(-4.0 * p[2]) * (1 + hashed(p)),
                     rising = up * std::exp(0.3 * p[2]);
        light.Q0[i] = static_cast<float>(falling + rising);
        light.Q1_flux[2][i] = static_cast<float>(rising - falling);
        light.shape->lean[2][i] = static_cast<float>(0.3 * falling - 0.1 * rising);
        light.shape->spread[2][i] = static_cast<float>(0.05 * falling);
      });
      SweepSource source;
      formSource(
          light.solution(1, [&](Coord p) { return down * std::pow(hashed(p, 3), 8) + up * hashed(p, 5); }),
          light.medium, {}, source);
      return source;
    };
    const SweepSource one = sourceOf(1, 0), other = sourceOf(0, 1), both = sourceOf(1, 1);
    size_t steep = 0;
    forEachVoxel(light.medium.topology(), [&](Coord, size_t i) {
      double steepness = 0;
      EXPECT_NEAR(both.J[i], one.J[i] + other.J[i], 1e-5 * both.J[i]);
      for (int a = 0; a < 3; ++a) {
        EXPECT_NEAR(both.slope[a][i], one.slope[a][i] + other.slope[a][i], 1e-4 * both.J[i]);
        steepness += 0.5 * std::abs(both.slope[a][i]);
      }
      steep += steepness > 0.5 * both.J[i];
    });
    EXPECT_GT(steep, 100u);  // or nothing has been tested
  }
}

}  // namespace
}  // namespace vdb_diffuse
