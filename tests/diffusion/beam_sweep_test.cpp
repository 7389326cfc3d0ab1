#include <gtest/gtest.h>

#include "diffusion/first_scatter.h"
#include "diffusion/source_shape.h"
#include "medium/wavefront.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

/// A lumpy medium, some 1 to 3 optical depths per voxel at its densest.
Medium lumpyMedium(double g = 0) {
  Medium medium = boxMedium(Coord(20, 17, 23), Transform::uniform(0.5), [](Coord p) {
    const double lump = std::sin(0.9 * p[0]) + std::cos(0.7 * p[1] + 0.3 * p[2]) + std::sin(0.5 * p[2]);
    return lump > 0 ? lump : -1.0;
  });
  medium.optics.sigma_s = Vec3d(1.8);
  medium.optics.sigma_a = Vec3d(0.2);
  medium.optics.g = g;
  return medium;
}

Scene sunAlong(const Vec3d& direction) {
  Scene scene;
  scene.lights.push_back({"sun", SunLight{direction.unit(), Vec3d(1), 0}});
  return scene;
}

double relativeRms(const Topology& topology, const Field<float>& a, const Field<float>& b) {
  double difference = 0, square = 0;
  for (size_t block = 0; block < topology.blockCount(); ++block)
    for (auto it = topology.active(block).beginOn(); it; ++it) {
      const double u = a.block(block)[it.pos()], v = b.block(block)[it.pos()];
      difference += (u - v) * (u - v);
      square += v * v;
    }
  return std::sqrt(difference / square);
}

FirstScatter lit(const Medium& medium, const Scene& scene, int rays, bool exact_march) {
  FirstScatterSettings settings;
  settings.rays_per_voxel = rays;
  settings.exact_march = exact_march;
  settings.want_flux = true;
  return firstScatter(medium, scene, Occluder(scene.surfaces), Model::kDefault, settings);
}

// Two ways to the same voxel averages: chords through points of each voxel marched to the sun one by one, and
// rays followed once through everything. With many rays both tend to the mean over the voxel.
TEST(BeamSweep, AgreesWithMarchingFromEveryVoxel) {
  for (const double g : {0.0, 0.7})
    for (const Vec3d& direction : {Vec3d(0.3, -0.5, -1), Vec3d(-1, 0.9, 0.2), Vec3d(0.1, 1, 0.95)}) {
      Medium medium = lumpyMedium(g);
      if (g > 0) setAlbedo(medium, [](Coord p, int) { return hashed(p); });
      const Scene scene = sunAlong(direction);
      const FirstScatter march = lit(medium, scene, 256, true), sweep = lit(medium, scene, 256, false);
      EXPECT_LT(relativeRms(medium.topology(), sweep.direct[0], march.direct[0]), 0.005);
      for (int a = 0; a < 3; ++a)
        EXPECT_LT(relativeRms(medium.topology(), sweep.beam_flux[0][a], march.beam_flux[0][a]), 0.005);
      if (g > 0) {
        EXPECT_LT(relativeRms(medium.topology(), sweep.beam[0], march.beam[0]), 0.005);
      }
      // Voxels of up to 3 optical depths: a few rays miss by a percent, and by less the more there are, down
      // to what the march itself misses.
      const double few =
          relativeRms(medium.topology(), lit(medium, scene, 9, false).direct[0], march.direct[0]);
      const double more =
          relativeRms(medium.topology(), lit(medium, scene, 81, false).direct[0], march.direct[0]);
      EXPECT_LT(few, 0.03);
      EXPECT_LT(more, std::max(few / 2, 0.004));
    }
}

// A triangle in an empty corner, edge on, hides nothing, but is a surface within the volume's box: then each
// ray is followed by itself, through the same places.
TEST(BeamSweep, BlocksSeeTheRaysThatAreFollowedOneByOne) {
  for (const double g : {0.0, 0.7})
    for (const Vec3d& direction : {Vec3d(0.3, -0.5, -1), Vec3d(-1, 0.9, 0.2), Vec3d(0.1, 1, 0.6)}) {
      Medium medium = lumpyMedium(g);
      medium.optics.sigma_s = Vec3d(1.8, 1.2, 0.6);
      setAlbedo(
          medium, [](Coord p, int c) { return hashed(p, c); }, 3);
      Scene scene = sunAlong(direction);
      const auto find = [&] {
        FirstScatterSettings settings;
        settings.want_flux = settings.want_shape = true;
        settings.phase_order = 2;
        return firstScatter(medium, scene, Occluder(scene.surfaces), Model::kDefault, settings);
      };
      const FirstScatter blocks = find();
      Surface edge;
      const Vec3d p(4, 4, 4), along = 1e-3 * direction;
      edge.mesh.positions = {p, p + along, p + 0.5 * along + Vec3d(1e-9, 0, 0)};
      edge.mesh.triangles = {{0, 1, 2}};
      scene.surfaces.push_back(edge);
      const FirstScatter rays = find();
      const auto same = [&](const Field<float>& a, const Field<float>& b, const Field<float>& light) {
        forEachVoxel(medium.topology(), [&](Coord voxel, size_t i) {
          ASSERT_NEAR(a[i], b[i], 1e-5 * light[i] + 1e-9) << voxel << ", sun along " << direction;
        });
      };
      ASSERT_EQ(blocks.direct.size(), 3u);
      ASSERT_EQ(blocks.beam.empty(), g == 0);
      for (size_t c = 0; c < 3; ++c) {
        const Field<float>& light = rays.sourceOf(c);
        same(blocks.direct[c], rays.direct[c], rays.direct[c]);
        same(blocks.sourceOf(c), light, light);
        for (int a = 0; a < 3; ++a) {
          same(blocks.beam_flux[c][a], rays.beam_flux[c][a], light);
          same(blocks.shape[c].lean[a], rays.shape[c].lean[a], light);
          same(blocks.shape[c].spread[a], rays.shape[c].spread[a], light);
        }
        for (size_t k = 0; g > 0 && k < rays.second_moments[c].size(); ++k)
          same(blocks.second_moments[c][k], rays.second_moments[c][k], light);
      }
    }
}

// Two far pieces, whose box holds more rays than memory: each is lit as it would be alone.
TEST(BeamSweep, PiecesFarApartAreLit) {
  const auto two =
      std::make_shared<const Topology>(std::vector<Coord>{Coord(0, 0, 0), Coord(1 << 20, 1 << 20, 0)},
                                       std::vector<BlockMask>(2, BlockMask(true)));
  ASSERT_TRUE(Wavefront::tooWide(*two, 9));
  Medium medium;
  medium.density.topology = two;
  medium.density.values = Field<float>(*two, 0.5f);
  const FirstScatter light = lit(medium, sunAlong(Vec3d(0, 0, -1)), 9, false);
  for (int z = 0; z < 8; ++z) {
    const double tau = 0.5, expected = std::exp(-tau * (7 - z)) * -std::expm1(-tau) / tau / (4 * M_PI);
    for (const Coord& p : {Coord(3, 4, z), Coord((1 << 20) + 5, (1 << 20) + 2, z)})
      EXPECT_NEAR(light.direct[0].at(*two, p), expected, 1e-6 * expected) << p;
  }
}

// Along a grid axis one ray per voxel is exact: the column above decides, and the voxel's own mean.
TEST(BeamSweep, IsExactAlongAnAxis) {
  const Medium medium = lumpyMedium();
  const FirstScatter light = lit(medium, sunAlong(Vec3d(0, 0, -1)), 1, false);
  const Topology& topology = medium.topology();
  for (int x = 0; x < 20; x += 3)
    for (int y = 0; y < 17; y += 2) {
      double before = 0;
      for (int z = 22; z >= 0; --z) {
        if (!topology.isActive(Coord(x, y, z))) continue;
        const double tau = 2.0 * 0.5 * medium.density.values.at(topology, Coord(x, y, z));
        const double mean = std::exp(-before) * (tau > 0 ? -std::expm1(-tau) / tau : 1) / (4 * M_PI);
        EXPECT_NEAR(light.direct[0].at(topology, Coord(x, y, z)), mean, 1e-6 * mean + 1e-12);
        before += tau;
      }
    }
}

// What an albedo field takes of the light that scatters straight on, f = g^2 of all, the beam loses.
TEST(BeamSweep, AnAlbedoFieldDimsTheRescaledBeamAlone) {
  Medium medium = lumpyMedium(0.7);
  setAlbedo(
      medium, [](Coord p, int c) { return c == 0 ? hashed(p) : 0.5; }, 3);
  for (const bool march : {false, true}) {
    const FirstScatter light = lit(medium, sunAlong(Vec3d(0, 0, -1)), 1, march);
    const Topology& topology = medium.topology();
    ASSERT_EQ(light.beam.size(), 3u);
    for (int c = 0; c < 3; ++c)
      for (int x = 0; x < 20; x += 3)
        for (int y = 0; y < 17; y += 2) {
          double before = 0, before_beam = 0;
          for (int z = 22; z >= 0; --z) {
            const Coord p(x, y, z);
            if (!topology.isActive(p)) continue;
            const double rho = 0.5 * medium.density.values.at(topology, p), a = c == 0 ? hashed(p) : 0.5;
            const auto mean = [](double passed, double tau) {
              return std::exp(-passed) * (tau > 0 ? -std::expm1(-tau) / tau : 1) / (4 * M_PI);
            };
            const double tau = 2 * rho, tau_beam = (2 - 0.49 * a * 1.8) * rho;
            EXPECT_NEAR(light.direct[c].at(topology, p), mean(before, tau), 1e-6 * mean(before, tau) + 1e-12);
            EXPECT_NEAR(light.beam[c].at(topology, p), mean(before_beam, tau_beam),
                        1e-6 * mean(before_beam, tau_beam) + 1e-12)
                << p << c;
            before += tau;
            before_beam += tau_beam;
          }
        }
  }
}

// What the rays lose the voxels gain, at any angle: extinction in the voxels is E (1 - exp(-tau)) over the
// shadow.
TEST(BeamSweep, ClosesTheEnergyOfAnObliqueBeam) {
  const double side = 8, sigma = 0.4;
  Medium medium = boxMedium(Coord(16, 16, 16), Transform::uniform(side / 16), [](Coord) { return 1.0; });
  medium.optics.sigma_s = Vec3d(sigma);
  const Vec3d d = Vec3d(0.4, 0.7, -1).unit();
  const FirstScatter light = lit(medium, sunAlong(d), 1024, false);
  double lost = 0;
  for (size_t i = 0; i < light.direct[0].size(); ++i)
    lost += 4 * M_PI * sigma * light.direct[0][i] * std::pow(side / 16, 3);
  // Chords of a cube: integrate over the three lit faces by brute force, an independent route.
  double expected = 0;
  constexpr int kSteps = 400;
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < kSteps; ++i)
      for (int j = 0; j < kSteps; ++j) {
        double p[3];
        p[axis] = d[axis] > 0 ? 0 : side;
        p[(axis + 1) % 3] = (i + 0.5) * side / kSteps;
        p[(axis + 2) % 3] = (j + 0.5) * side / kSteps;
        double chord = 1e9;
        for (int a = 0; a < 3; ++a) chord = std::min(chord, ((d[a] > 0 ? side : 0) - p[a]) / d[a]);
        expected += std::abs(d[axis]) * (side / kSteps) * (side / kSteps) * -std::expm1(-sigma * chord);
      }
  EXPECT_NEAR(lost, expected, 2e-4 * expected);
}

FirstScatter shaped(const Medium& medium, const Scene& scene) {
  FirstScatterSettings settings;
  settings.want_shape = true;
  return firstScatter(medium, scene, Occluder({}), Model::kDefault, settings);
}

TEST(BeamShape, EvenLightHasNone) {
  Medium medium = boxMedium(Coord(9, 10, 11), Transform::uniform(1), [](Coord) { return 1e-6; });
  Scene sky;
  sky.lights.push_back({"sky", DomeLight{Vec3d(1), nullptr, 0}});
  for (const Scene& scene : {sunAlong(Vec3d(0, 0, -1)), sunAlong(Vec3d(0.02, 1, 0)),
                             sunAlong(Vec3d(1, 0.99, 0.3)), sunAlong(Vec3d(-0.3, 0.5, 0.8)), sky}) {
    const FirstScatter light = shaped(medium, scene);
    forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
      for (int a = 0; a < 3; ++a) {
        EXPECT_NEAR(light.shape[0].lean[a][i], 0, 1e-5 * light.direct[0][i]) << p << ", axis " << a;
        EXPECT_NEAR(light.shape[0].spread[a][i], 0, 1e-5 * light.direct[0][i]) << p << ", axis " << a;
      }
    });
  }
}

// Below a flat face light falls as exp(-tau z / mu) whatever else its direction is.
TEST(BeamShape, IsThatOfTheDecayBelowAFlatFace) {
  constexpr int kWidth = 64, kLayers = 3;
  for (double depth : {0.5, 2.0})
    for (const Vec3d& d : {Vec3d(0, 0, -1), Vec3d(0.3, 0.2, -1), Vec3d(1, 0.4, -0.8), Vec3d(1, 0.3, -0.4)}) {
      Medium medium =
          boxMedium(Coord(kWidth, kWidth, kLayers), Transform::uniform(1), [](Coord) { return 1.0; });
      medium.optics.sigma_s = Vec3d(depth);
      const FirstScatter light = shaped(medium, sunAlong(d));
      const double tau = depth / std::abs(d.unit()[2]);
      const DecayMoments decay = decayMoments(tau);
      const double lean = 0.5 - decay.m1 / decay.m0,  // up, toward the light
          spread = 0.25 - decay.m1 / decay.m0 + decay.m2 / decay.m0 - 1. / 12;
      double sum = 0, leans[3] = {}, spreads[3] = {};
      for (int n = 0; n < 256; ++n) {
        const Coord p(kWidth / 2 - 8 + n / 16, kWidth / 2 - 8 + n % 16, kLayers - 1);
        sum += light.direct[0].at(medium.topology(), p);
        for (int a = 0; a < 3; ++a) {
          leans[a] += light.shape[0].lean[a].at(medium.topology(), p);
          spreads[a] += light.shape[0].spread[a].at(medium.topology(), p);
        }
      }
      for (int a = 0; a < 3; ++a) {  // nine rays in a voxel, aslant where the beam is not nearest to z
        EXPECT_NEAR(leans[a] / sum, a == 2 ? lean : 0, (a == 2 ? 0.06 : 0.25) * lean)
            << d << " depth " << depth << " axis " << a;
        EXPECT_NEAR(spreads[a] / sum, a == 2 ? spread : 0, 0.01) << d << " depth " << depth << " axis " << a;
      }
    }
}

// A lamp is marched to from parts of each voxel, by other code than a beam's; far away it is a sun.
TEST(BeamShape, OfAFarLampIsThatOfTheSun) {
  const double far = 1e5;
  for (double depth : {0.5, 2.0}) {
    Medium medium = boxMedium(Coord(8, 8, 3), Transform::uniform(1), [](Coord) { return 1.0; });
    medium.optics.sigma_s = Vec3d(depth);
    Scene lamp;
    lamp.lights.push_back({"lamp", PointLight{Vec3d(3.5, 3.5, far), Vec3d(far * far), 0}});
    const FirstScatter sunlit = shaped(medium, sunAlong(Vec3d(0, 0, -1))), lamplit = shaped(medium, lamp);
    const auto of = [&](const Field<float>& field, int z) {
      return field.at(medium.topology(), Coord(4, 4, z));
    };
    for (int z : {2, 1}) {
      const double light = of(sunlit.direct[0], z);
      EXPECT_NEAR(of(lamplit.direct[0], z), light, 0.02 * light) << depth;
      for (int a = 0; a < 3; ++a) {
        EXPECT_NEAR(of(lamplit.shape[0].lean[a], z), of(sunlit.shape[0].lean[a], z), 0.01 * light) << depth;
        EXPECT_NEAR(of(lamplit.shape[0].spread[a], z), of(sunlit.shape[0].spread[a], z), 0.01 * light)
            << depth;
      }
    }
  }
}

// A plate between sun and box: dark behind it, untouched beside it.
TEST(BeamSweep, APlateDarkensItsShadowAndNothingElse) {
  Medium medium = boxMedium(Coord(16, 16, 16), Transform::uniform(1), [](Coord) { return 0.1; });
  Scene scene = sunAlong(Vec3d(0, 0, -1));
  const FirstScatter open = lit(medium, scene, 4, false);
  Surface plate;
  plate.mesh.positions = {{-50, -50, 30}, {7.5, -50, 30}, {7.5, 50, 30}, {-50, 50, 30}};
  plate.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.surfaces.push_back(plate);
  const FirstScatter shaded = lit(medium, scene, 4, false);
  for (size_t b = 0; b < medium.topology().blockCount(); ++b)
    for (auto it = medium.topology().active(b).beginOn(); it; ++it) {
      const bool behind = (medium.topology().origin(b) + voxelLocal(static_cast<int>(it.pos())))[0] <= 7;
      EXPECT_EQ(shaded.direct[0].block(b)[it.pos()], behind ? 0.0f : open.direct[0].block(b)[it.pos()]);
    }
}

// Light that a sunlit ground throws up, by the sweep and by looking for the ground from every voxel. Both
// take the same directions; the march looks along one ray through each voxel's centre.
TEST(BeamSweep, ReflectedLightAgreesWithMarching) {
  Medium medium = boxMedium(Coord(16, 16, 16), Transform::uniform(0.5), [](Coord) { return 0.3; });
  Scene scene = sunAlong(Vec3d(0, 0, -1));
  const auto total = [&](bool exact_march) {
    const FirstScatter light = lit(medium, scene, 1, exact_march);
    double sum = 0;
    for (size_t i = 0; i < light.direct[0].size(); ++i) sum += light.direct[0][i];
    return sum;
  };
  const double sun = total(false);
  Surface ground;
  ground.mesh.positions = {{-40, -40, -2}, {40, -40, -2}, {40, 40, -2}, {-40, 40, -2}};
  ground.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  ground.albedo = Vec3d(0.6);
  scene.surfaces.push_back(ground);
  const double march = total(true) - sun, sweep = total(false) - sun;
  EXPECT_GT(march, 0.1 * sun);
  EXPECT_NEAR(sweep, march, 0.02 * march);
}

// Plates within the volume, behind and before one another: each ray starts at the last one before its first
// voxel and changes its light at those on its way, of sun and of what the plates reflect.
TEST(BeamSweep, PlatesInTheVolumeAgreeWithMarching) {
  Medium medium = boxMedium(Coord(16, 16, 16), Transform::uniform(0.5),
                            [](Coord p) { return p[2] >= 6 && p[2] < 8 ? -1.0 : 0.3; });
  Scene scene = sunAlong(Vec3d(0.3, 0.2, -1));
  scene.surfaces.push_back({"below", quad(Vec3d(-9, -9, -2), Vec3d(30, 0, 0), Vec3d(0, 30, 0)), Vec3d(0.9)});
  scene.surfaces.push_back({"in", quad(Vec3d(-9, -9, 1.75), Vec3d(13, 0, 0), Vec3d(0, 30, 0)), Vec3d(0.6)});
  scene.surfaces.push_back({"gap", quad(Vec3d(2, -9, 3.2), Vec3d(13, 0, 0), Vec3d(0, 12, 0)), Vec3d(0.6)});
  const auto light = [&](bool exact_march) {
    FirstScatterSettings settings;
    settings.rays_per_voxel = 64;
    settings.exact_march = exact_march;
    settings.gather_directions = 1000;
    return firstScatter(medium, scene, Occluder(scene.surfaces), Model::kDefault, settings);
  };
  const FirstScatter march = light(true), sweep = light(false);
  for (int z : {0, 3, 5, 8, 12}) {
    double expected = 0, found = 0;
    for (int x = 0; x < 16; ++x)
      for (int y = 0; y < 16; ++y) {
        expected += march.direct[0].at(medium.topology(), Coord(x, y, z));
        found += sweep.direct[0].at(medium.topology(), Coord(x, y, z));
      }
    EXPECT_NEAR(found, expected, 0.02 * expected) << z;
  }
}

}  // namespace
}  // namespace vdb_diffuse
