#include "reference/runs.h"

namespace vdb_diffuse {
namespace {

/// A box about the origin that neither hides nor scatters anything to speak of.
Medium thinBox(int n, double h) {
  Medium medium = boxMedium(
      Coord(n), Transform::uniform(h), [](Coord) { return 1.0; }, Coord(-n / 2));
  setOptics(medium, 1e-9, 0.5);
  return medium;
}

template <typename AnyLight>
Scene only(const AnyLight& light) {
  Scene scene;
  scene.lights.push_back({"lamp", light});
  return scene;
}

/// Holds the direct light against `mean_radiance(p)`, the mean over directions at a point, averaged over
/// 4^3 points of each voxel: the whole volume's sum, and the voxels' own values within the noise of so many
/// rays.
void expectDirect(const Medium& medium, const Scene& scene,
                  const std::function<double(const Vec3d&)>& mean_radiance, const std::string& what,
                  double tolerance = 0.004) {
  const ReferenceResult result = reference(medium, scene, paths(2e5));
  ASSERT_EQ(result.direct.size(), 1u) << what;
  double sum = 0, expected_sum = 0, difference = 0, square = 0;
  forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
    double expected = 0;
    for (int s = 0; s < 64; ++s) {
      const Vec3d within(((s & 3) - 1.5) / 4, ((s >> 2 & 3) - 1.5) / 4, ((s >> 4) - 1.5) / 4);
      expected += mean_radiance(medium.transform().toWorld(p.asVec3d() + within)) / 64;
    }
    sum += result.direct[0][i];
    expected_sum += expected;
    difference += std::pow(result.direct[0][i] - expected, 2);
    square += expected * expected;
  });
  EXPECT_NEAR(sum / expected_sum, 1, tolerance) << what;
  EXPECT_LT(std::sqrt(difference / square), 0.15) << what;
}

double discShare(double sine) {
  return 0.5 * (1 - std::sqrt(1 - sine * sine));  // of the sphere, that a ball of this sine of radius covers
}

TEST(ReferenceLamps, PointsAndBallsFallAsTheyShould) {
  const Medium medium = thinBox(12, 0.5);
  for (const Vec3d& at : {Vec3d(9, -4, 6), Vec3d(0.8, 4, 0.3)})
    expectDirect(
        medium, only(PointLight{at, Vec3d(7), 0}),
        [&](const Vec3d& p) { return 7 / (4 * M_PI * (p - at).lengthSqr()); }, "point");
  const Vec3d at(1, 6, -2);  // radiance 7 / (pi r^2)
  expectDirect(
      medium, only(PointLight{at, Vec3d(7), 2}),
      [&](const Vec3d& p) { return 7 / (M_PI * 4) * discShare(2 / (p - at).length()); }, "ball");
  const Vec3d inside(0.1, -0.2, 0.15);  // all that is emitted crosses every shell
  const ReferenceResult result = reference(medium, only(PointLight{inside, Vec3d(7), 0}), paths(2e5));
  double sum = 0, expected = 0;
  forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
    const Vec3d d = p.asVec3d() * 0.5 - inside;
    if (d.length() < 1.5) return;
    sum += result.direct[0][i];
    for (int s = 0; s < 64; ++s)
      expected += 7 / (4 * M_PI) / 64 /
                  (d + Vec3d(((s & 3) - 1.5), ((s >> 2 & 3) - 1.5), ((s >> 4) - 1.5)) / 8).lengthSqr();
  });
  EXPECT_NEAR(sum / expected, 1, 0.004);
}

TEST(ReferenceLamps, SpotFadesAsCycles) {
  const Medium medium = thinBox(12, 0.5);
  SpotLight spot;
  spot.position = Vec3d(1, 0, 8);
  spot.direction = Vec3d(0.1, 0, -1).unit();
  spot.intensity = Vec3d(7);
  spot.angle = 0.5;
  spot.blend = 0.4;
  const double outer = std::cos(0.25), inner = outer + 0.4 * (1 - outer);
  expectDirect(
      medium, only(spot),
      [&](const Vec3d& p) {
        const Vec3d d = p - spot.position;
        const double t = std::clamp((d.unit().dot(spot.direction) - outer) / (inner - outer), 0.0, 1.0);
        return 7 * t * t * (3 - 2 * t) / (4 * M_PI * d.lengthSqr());
      },
      "spot");
}

TEST(ReferenceLamps, AreaShinesFromItsFront) {
  const Medium medium = thinBox(10, 0.5);
  const Mesh front = quad(Vec3d(-2, 5, -1), Vec3d(4, 0, 0), Vec3d(0, 0, 3));  // looks to -y
  Mesh back = front;
  for (auto& t : back.triangles) std::swap(t[1], t[2]);
  const auto seen = [&](const Vec3d& p) {  // 5 W/m2/sr over 24 x 18 pieces
    double sum = 0;
    for (int i = 0; i < 24; ++i)
      for (int j = 0; j < 18; ++j) {
        const Vec3d d = p - Vec3d(-2 + (i + 0.5) / 6, 5, -1 + (j + 0.5) / 6);
        sum += 5 * -d[1] / d.length() / d.lengthSqr() / 36;
      }
    return sum / (4 * M_PI);
  };
  expectDirect(medium, only(AreaLight{front, Vec3d(5)}), seen, "area");
  const ReferenceResult dark = reference(medium, only(AreaLight{back, Vec3d(5)}), paths(1000));
  EXPECT_EQ(meanOf(medium.topology(), dark.direct[0]), 0);
}

TEST(ReferenceLamps, SunsAndSkiesHaveTheirRadiance) {
  const Medium medium = thinBox(9, 0.5);
  for (double angle : {0.0, 0.0093, 0.6, 1.5}) {
    const double a = 0.5 * angle;
    const double mean = angle > 0 ? 4 * (1 - std::cos(a)) / (2 * M_PI * std::sin(a) * std::sin(a))
                                  : 4 / (4 * M_PI);  // L = E / (pi sin^2 a) over 2 pi (1 - cos a)
    expectDirect(
        medium, only(SunLight{Vec3d(1, 2, -3).unit(), Vec3d(4), angle}), [&](const Vec3d&) { return mean; },
        "sun " + std::to_string(angle), 0.002);
  }
  expectDirect(
      medium, only(DomeLight{Vec3d(3), nullptr, 0}), [](const Vec3d&) { return 3.0; }, "sky", 0.002);
}

// An image bright in one quarter: u in 0..1/2 looks to +y, v in 0..1/2 up, before the turn.
TEST(ReferenceLamps, ImageIsWhereItSaysItIs) {
  const Medium medium = thinBox(9, 0.5);
  auto image = std::make_shared<Image>();
  image->width = 16;
  image->height = 8;
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 16; ++x) image->pixels.push_back(Vec3f(x < 8 && y < 4 ? 2.0f : 0.25f));
  DomeLight dome;
  dome.radiance = Vec3d(3);
  dome.image = image;
  expectDirect(
      medium, only(dome), [](const Vec3d&) { return 3 * (2 * 0.25 + 0.25 * 0.75); }, "image", 0.002);
  Scene scene = only(dome);  // a plate below hides the lower half
  scene.surfaces.push_back({"plate", quad(Vec3d(-1e4, -1e4, -3), Vec3d(2e4, 0, 0), Vec3d(0, 2e4, 0))});
  expectDirect(
      medium, scene, [](const Vec3d&) { return 3 * (2 * 0.25 + 0.25 * 0.25); }, "image and plate", 0.003);
  ReferenceSettings settings = paths(4e5);
  settings.want_flux = true;  // of scattered light, which leaves as it came: none is left in the mean
  scene.surfaces[0].mesh = quad(Vec3d(-1e4, 3, -1e4), Vec3d(0, 0, 2e4), Vec3d(2e4, 0, 0));
  dome.rotation = M_PI;  // now the bright quarter is at -y, and this plate hides +y
  scene.lights = only(dome).lights;
  expectDirect(
      medium, scene, [](const Vec3d&) { return 3 * (2 * 0.25 + 0.25 * 0.25); }, "turned", 0.003);
}

}  // namespace
}  // namespace vdb_diffuse
