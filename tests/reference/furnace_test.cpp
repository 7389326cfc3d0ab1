#include "reference/runs.h"

namespace vdb_diffuse {
namespace {

// In a uniform sky of radiance L, a medium that only scatters has L everywhere; so has one that absorbs and
// glows with Q = L, and white surfaces change nothing.
constexpr double kL = 3;

struct Furnace {
  double sigma, albedo, g;
  Vec3d colour{1, 1, 1};  // factor on sigma, by channel
  bool plate = false;
};

Repeated relativeMeans(const Furnace& f) {
  Medium medium =
      boxMedium(Coord(10, 8, 12), Transform(Vec3d(0.5, 0, 0), Vec3d(0, -0.7, 0), Vec3d(0, 0, 0.4), Vec3d(9)),
                [](Coord p) { return lumpyDensity(p); });
  setOptics(medium, f.sigma, f.albedo, f.g);
  medium.optics.sigma_s *= f.colour;
  medium.optics.sigma_a *= f.colour;
  if (f.albedo < 1) setEmission(medium, [](Coord) { return kL; });
  Scene scene;
  scene.lights.push_back({"sky", DomeLight{Vec3d(kL), nullptr, 0}});
  if (f.plate) {  // through the middle of the volume, and beyond its sides
    const Vec3d middle = medium.transform().toWorld(Vec3d(4.6, 3.6, 5.6));
    scene.surfaces.push_back(
        {"plate", quad(middle - Vec3d(4, 4, 0.5), Vec3d(8, 0, 1), Vec3d(0, 8, 0)), Vec3d(1)});
  }
  Repeated means;
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    const ReferenceResult result = reference(medium, scene, paths(1e4, seed));
    EXPECT_LT(std::abs(result.energy.closure()), 1e-9);
    double sum = 0;
    for (size_t c = 0; c < result.diffuse.size(); ++c)
      sum += (meanOf(medium.topology(), result.direct[c]) + meanOf(medium.topology(), result.diffuse[c])) /
             (kL * static_cast<double>(result.diffuse.size()));
    means.values.push_back(sum);
  }
  return means;
}

TEST(ReferenceFurnace, RadianceIsThatOfTheSky) {
  for (const Furnace& f :
       {Furnace{0.05, 1, 0}, Furnace{1, 1, 0}, Furnace{10, 1, 0}, Furnace{3, 1, 0.85}, Furnace{3, 1, -0.6},
        Furnace{20, 1, 0.999}, Furnace{2, 0.9, 0.5}, Furnace{8, 0.4, 0}, Furnace{1, 0, 0}}) {
    const Repeated means = relativeMeans(f);
    expectMean(means, 1,
               "sigma " + std::to_string(f.sigma) + " albedo " + std::to_string(f.albedo) + " g " +
                   std::to_string(f.g));
    EXPECT_LT(means.error(), 0.005);
  }
}

// Every other block is missing: a ray that has crossed a gap collides where it is then, not where it would be
// without the gap.
TEST(ReferenceFurnace, GapsBetweenBlocksChangeNothing) {
  Medium medium = boxMedium(Coord(40, 40, 40), Transform(),
                            [](Coord p) { return (p[0] / 8 + p[1] / 8 + p[2] / 8) % 2 ? -1.0 : 1.0; });
  setOptics(medium, 0.2, 1);
  Scene scene;
  scene.lights.push_back({"sky", DomeLight{Vec3d(kL), nullptr, 0}});
  Repeated means;
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    const ReferenceResult result = reference(medium, scene, paths(2e4, seed));
    means.values.push_back(
        (meanOf(medium.topology(), result.direct[0]) + meanOf(medium.topology(), result.diffuse[0])) / kL);
  }
  expectMean(means, 1);
  EXPECT_LT(means.error(), 0.003);
}

TEST(ReferenceFurnace, ColouredExtinctionChangesNothing) {
  for (const Furnace& f : {Furnace{2, 1, 0.3, Vec3d(1, 0.5, 3)}, Furnace{2, 0.8, 0, Vec3d(4, 1, 0.2)},
                           Furnace{2, 1, 0, Vec3d(1, 0.5, 3), true}}) {
    const Repeated means = relativeMeans(f);
    expectMean(means, 1);
    EXPECT_LT(means.error(), 0.01);
  }
}

TEST(ReferenceFurnace, WhitePlateInTheVolumeChangesNothing) {
  const Repeated means = relativeMeans({2, 1, 0.4, Vec3d(1), true});
  expectMean(means, 1);
  EXPECT_LT(means.error(), 0.01);
}

}  // namespace
}  // namespace vdb_diffuse
