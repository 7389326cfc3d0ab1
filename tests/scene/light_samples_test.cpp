#include "scene/light_samples.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vdb_diffuse {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kRounding = 1e-12;

LightSamples sampled(const Light& light, const LightSampling& settings = {}) {
  Scene scene;
  scene.lights.push_back({"", light});
  return sampleLights(scene, settings);
}

/// Irradiance on a plane whose front looks along `normal`.
Vec3d onPlane(const LightSamples& samples, const Vec3d& normal) {
  Vec3d sum(0);
  for (const BeamSample& b : samples.beams) sum += b.irradiance * std::max(0.0, -b.direction.dot(normal));
  return sum;
}

/// Two triangles, side 2w, in the plane z = 0, front (+z) where `up`.
Mesh panel(double w, bool up) {
  Mesh mesh;
  mesh.positions = {Vec3d(-w, -w, 0), Vec3d(w, -w, 0), Vec3d(w, w, 0), Vec3d(-w, w, 0)};
  if (up)
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  else
    mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
  return mesh;
}

TEST(SunSamples, SharpSunIsOneBeam) {
  SunLight sun{Vec3d(0, 3, -4), Vec3d(3, 2, 1), 0.0093};
  const LightSamples samples = sampled(sun);
  ASSERT_EQ(samples.beams.size(), 1u);
  EXPECT_LT((samples.beams[0].direction - Vec3d(0, 0.6, -0.8)).length(), kRounding);
  EXPECT_EQ(samples.beams[0].irradiance, sun.irradiance);
}

TEST(SunSamples, WideSunGivesItsIrradianceToAFacingPlaneFromWithinItsDisc) {
  for (double angle : {0.05, 0.7, 2.0}) {
    const Vec3d axis = Vec3d(0.3, -0.5, -1).unit();
    const LightSamples samples = sampled(SunLight{axis, Vec3d(3, 2, 1), angle});
    ASSERT_EQ(samples.beams.size(), 16u);
    EXPECT_LT((onPlane(samples, -axis) - Vec3d(3, 2, 1)).length(), kRounding);
    Vec3d mean(0);
    for (const BeamSample& b : samples.beams) {
      EXPECT_NEAR(b.direction.length(), 1, kRounding);
      EXPECT_LT(std::acos(b.direction.dot(axis)), 0.5 * angle);
      mean += b.direction / 16.0;
    }
    EXPECT_LT(mean.cross(axis).length(), 0.5 * angle / 10) << "the middle of the disc is the axis";
  }
}

TEST(PointSamples, BallSharesItsIntensity) {
  const LightSamples samples = sampled(PointLight{Vec3d(1, 2, 3), Vec3d(16, 8, 4), 0.5});
  Vec3d intensity(0), middle(0);
  for (const PointSample& p : samples.points) {
    EXPECT_NEAR((p.position - Vec3d(1, 2, 3)).length(), 0.5, kRounding);
    EXPECT_EQ(p.falloff(Vec3d(0, 1, 0)), 1);
    intensity += p.intensity;
    middle += p.position / double(samples.points.size());
  }
  EXPECT_LT((intensity - Vec3d(16, 8, 4)).length(), kRounding);
  EXPECT_LT((middle - Vec3d(1, 2, 3)).length(), 0.5 / 16);
  EXPECT_EQ(sampled(PointLight{}).points.size(), 1u);
}

TEST(SpotSamples, FallsFromInnerToOuterConeAsASmoothstep) {
  const double outer = std::cos(kPi / 6), inner = outer + 0.25 * (1 - outer);
  const LightSamples samples = sampled(SpotLight{Vec3d(0), Vec3d(0, 0, -2), Vec3d(1), kPi / 3, 0.25});
  ASSERT_EQ(samples.points.size(), 1u);
  const auto at = [&](double c) { return samples.points[0].falloff(Vec3d(std::sqrt(1 - c * c), 0, -c)); };
  EXPECT_EQ(at(1), 1);
  EXPECT_EQ(at(inner + 1e-9), 1);
  EXPECT_NEAR(at(0.5 * (inner + outer)), 0.5, kRounding);
  EXPECT_NEAR(at(outer + 0.25 * (inner - outer)), 0.15625, 1e-9) << "3/16 - 2/64";
  EXPECT_EQ(at(outer - 1e-9), 0);
  EXPECT_EQ(at(-1), 0);
}

TEST(SpotSamples, PowerIsThatOfTheConeWithHalfItsEdge) {
  for (double blend : {0.0, 0.15, 1.0}) {
    const double outer = std::cos(kPi / 8), inner = outer + blend * (1 - outer);
    const LightSamples samples = sampled(SpotLight{Vec3d(0), Vec3d(0, 0, -1), Vec3d(2), kPi / 4, blend});
    const int n = 100000;
    double power = 0;
    for (int i = 0; i < n; ++i) {
      const double c = -1 + (2 * i + 1.0) / n;
      power += 2 * 2 * kPi * 2.0 / n * samples.points[0].falloff(Vec3d(0, std::sqrt(1 - c * c), -c));
    }
    EXPECT_NEAR(power, 2 * 2 * kPi * (1 - inner + 0.5 * (inner - outer)), 2 * 2 * kPi * 2.0 / n);
  }
}

TEST(AreaSamples, FluxIsPiTimesRadianceTimesArea) {
  Mesh mesh = panel(1.5, true);
  mesh.positions.push_back(Vec3d(0, 0, 7));
  mesh.triangles.push_back({0, 1, 4});
  mesh.triangles.push_back({2, 2, 3});  // no area, no light
  const double area = 9 + 0.5 * 3 * std::hypot(7, 1.5);
  for (int points : {1, 7, 64}) {
    LightSampling settings;
    settings.area_points = points;
    const LightSamples samples = sampled(AreaLight{mesh, Vec3d(5, 4, 0)}, settings);
    ASSERT_EQ(samples.points.size(), size_t(points));
    Vec3d flux(0);
    for (const PointSample& p : samples.points) flux += kPi * p.intensity;  // a cosine lobe emits pi I
    EXPECT_LT((flux - kPi * area * Vec3d(5, 4, 0)).length(), 1e-10);
  }
}

TEST(AreaSamples, ShineFromTheFrontOnly) {
  const LightSamples samples = sampled(AreaLight{panel(1, false), Vec3d(1)});
  for (const PointSample& p : samples.points) {
    EXPECT_NEAR(p.falloff(Vec3d(0, 0, -1)), 1, kRounding);
    EXPECT_NEAR(p.falloff(Vec3d(0, 0.6, -0.8)), 0.8, kRounding);
    EXPECT_EQ(p.falloff(Vec3d(0, 0, 1)), 0);
  }
}

TEST(AreaSamples, PointsAreSharedOutByArea) {
  Mesh mesh;
  mesh.positions = {Vec3d(0, 0, 0), Vec3d(3, 0, 0), Vec3d(0, 1, 0), Vec3d(-1, 0, 0)};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  int right = 0;
  for (const PointSample& p : sampled(AreaLight{mesh, Vec3d(1)}).points) right += p.position[0] > 0;
  EXPECT_EQ(right, 48);
}

TEST(AreaSamples, PanelLightsAPlaneAsItsFormFactorSays) {
  // A square of half side a at height a: the corner quarter's form factor is known in closed form.
  const double a = 1, s = a / std::sqrt(a * a + a * a);
  const double form_factor = 4 * (2 * s * std::atan(s)) / (2 * kPi);
  double irradiance = 0;
  for (const PointSample& p : sampled(AreaLight{panel(a, false), Vec3d(1)}).points) {
    const Vec3d to = Vec3d(0, 0, -a) - p.position, d = to.unit();
    irradiance += p.intensity[0] * p.falloff(d) * -d[2] / to.lengthSqr();
  }
  EXPECT_NEAR(irradiance, kPi * form_factor, 0.01 * kPi * form_factor);
}

TEST(LightSamples, DarkLightsGiveNone) {
  Scene scene;
  scene.lights = {{"", SunLight{Vec3d(0, 0, -1), Vec3d(0), 0}},
                  {"", PointLight{Vec3d(0), Vec3d(0), 0}},
                  {"", SpotLight{Vec3d(0), Vec3d(0, 0, -1), Vec3d(0), 1, 0}},
                  {"", AreaLight{panel(1, true), Vec3d(0)}},
                  {"", AreaLight{Mesh(), Vec3d(1)}},
                  {"", DomeLight{Vec3d(0), nullptr, 0}}};
  const LightSamples samples = sampleLights(scene);
  EXPECT_TRUE(samples.beams.empty() && samples.points.empty());
}

}  // namespace
}  // namespace vdb_diffuse
