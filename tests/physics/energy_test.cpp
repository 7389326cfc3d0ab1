#include <gtest/gtest.h>

#include "diffusion/diffuse.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

Medium lumpyMedium(const Vec3d& sigma_s, const Vec3d& sigma_a, double g, double h = 0.4) {
  Medium medium =
      boxMedium(Coord(21, 18, 23), Transform::uniform(h), [](Coord p) { return lumpyDensity(p); });
  medium.optics.sigma_s = sigma_s;
  medium.optics.sigma_a = sigma_a;
  medium.optics.g = g;
  return medium;
}

/// Power that a field of radiances gives up in a medium by sigma: 4 pi V sum of sigma rho I.
double power(const Medium& medium, const Vec3d& sigma, const Channels& I) {
  double sum = 0;
  for (size_t c = 0; c < 3; ++c) {
    const Field<float>& channel = I[std::min(c, I.size() - 1)];
    forEachVoxel(medium.topology(), [&](Coord, size_t i) {
      sum += kLuminance[c] * sigma[static_cast<int>(c)] * medium.density.values[i] * channel[i];
    });
  }
  return 4 * M_PI * medium.transform().voxelVolume() * sum;
}

TEST(Energy, ClosesForAnyMedium) {
  const Vec3d grey(0.8), coloured(0.5, 1, 2), little(0.05), coloured_little(0, 0.1, 0.4);
  Scene walled = sunScene(Vec3d(0.3, 0.2, -1));
  walled.surfaces.push_back({"inside", quad(Vec3d(1, 1, 4.1), Vec3d(4, 0, 0), Vec3d(0, 5, 0)), Vec3d(0.5)});
  walled.surfaces.push_back(
      {"tilted", quad(Vec3d(3.1, -1, -1), Vec3d(2, 0, 9), Vec3d(0, 9, 0)), Vec3d(0.9, 0.2, 0)});
  walled.lights.push_back({"lamp", PointLight{Vec3d(3, 3, 3), Vec3d(5, 2, 1), 0}});
  const Scene sun = sunScene(Vec3d(0.3, 0.2, -1)), dark;
  struct Case {
    const char* name;
    Vec3d sigma_s, sigma_a;
    double g;
    const Scene* scene;
    bool emits;
  };
  const Case cases[] = {{"grey", grey, little, 0, &sun, false},
                        {"grey, conservative", grey, Vec3d(0), 0, &sun, false},
                        {"coloured", coloured, coloured_little, 0, &sun, false},
                        {"forward", grey, little, 0.7, &sun, false},
                        {"forward, coloured", coloured, coloured_little, 0.7, &sun, true},
                        {"backward", grey, little, -0.4, &sun, false},
                        {"emission", grey, little, 0, &dark, true},
                        {"emission that does not scatter", Vec3d(0), grey, 0, &dark, true},
                        {"walls", grey, little, 0, &walled, true},
                        {"walls, forward", coloured, coloured_little, 0.7, &walled, true}};
  const Model models[] = {Model::kDefault, Model::kP1};
  for (const Case& test : cases)
    for (Model model : models)
      for (bool capped : {false, true}) {
        Medium medium = lumpyMedium(test.sigma_s, test.sigma_a, test.g);
        if (test.emits) setEmission(medium, [](Coord p) { return hashed(p, 11); });
        DiffuseSettings settings;
        settings.model = {model, capped ? 1.0 : kNone};
        settings.tolerance = 1e-5;
        const DiffuseResult result = diffuse(medium, *test.scene, settings);
        ::testing::Message where;
        where << test.name << (model == Model::kP1 ? ", P1" : ", default") << (capped ? ", capped" : "");
        EXPECT_TRUE(result.converged) << where;
        EXPECT_LT(std::abs(result.energy.closure()), 10 * settings.tolerance) << where;
        EXPECT_GT(result.energy.escaped, 0) << where;
        // The same powers once more, from the fields that were returned.
        const double in = result.energy.scattered_in + result.energy.emitted;
        EXPECT_NEAR(result.energy.scattered_in, power(medium, test.sigma_s, result.direct), 1e-5 * in)
            << where;
        if (test.emits) {
          EXPECT_NEAR(result.energy.emitted, power(medium, test.sigma_a, medium.emission), 1e-5 * in)
              << where;
        }
        if (result.negative_voxels == 0) {
          EXPECT_NEAR(result.energy.absorbed, power(medium, test.sigma_a, result.diffuse), 1e-5 * in)
              << where;
        }
      }
}

// The flux through open faces, (I0 + (h/2) q.n) / (r + 2).
TEST(Energy, EscapesThroughTheOpenFaces) {
  for (double g : {0.0, 0.25, -0.25}) {
    Medium medium = lumpyMedium(Vec3d(0.8), Vec3d(0.1), g);
    DiffuseSettings settings;
    settings.model.model = Model::kP1;
    settings.tolerance = 1e-6;
    settings.want_flux = true;
    const Vec3d d(0, 0, -1);
    const DiffuseResult result = diffuse(medium, sunScene(d), settings);
    const Topology& topology = medium.topology();
    const Field<float>& Q = result.direct[0];
    const double h = medium.transform().meanVoxelSize(), sigma_tr = 0.1 + (1 - g) * 0.8;
    double escaped = 0;
    forEachVoxel(topology, [&](Coord p, size_t i) {
      const double rho = medium.density.values[i], r = 1.5 * sigma_tr * rho * h;
      const auto beside = [&](int a, int side) {
        Coord next = p;
        next[a] += side;
        return next;
      };
      for (int a = 0; a < 3; ++a)
        for (int side : {-1, 1}) {
          if (topology.isActive(beside(a, side))) continue;
          const double drive = 0.5 * h * 0.8 * rho * 3 * g * d[a] * side * Q[i];
          escaped += 4 * M_PI * h * h * (result.diffuse[0][i] + drive) / (r + 2);
        }
    });
    ASSERT_EQ(result.negative_voxels, 0u) << "g " << g;
    EXPECT_NEAR(result.energy.escaped, escaped, 2e-5 * result.energy.scattered_in) << "g " << g;
  }
}

/// What a beam along d loses in a medium: E times the sum over its columns of h^2 (1 - exp(-tau)).
double lostFromAxisBeam(const Medium& medium, int axis) {
  const Topology& topology = medium.topology();
  const double h = medium.transform().meanVoxelSize(), sigma_t = medium.optics.sigmaT()[0];
  double lost = 0;
  for (int u = 0; u < 32; ++u)
    for (int v = 0; v < 32; ++v) {
      double tau = 0;
      for (int w = 0; w < 32; ++w) {
        Coord p;
        p[axis] = w, p[(axis + 1) % 3] = u, p[(axis + 2) % 3] = v;
        if (topology.isActive(p)) tau += sigma_t * h * medium.density.values.at(topology, p);
      }
      lost -= h * h * std::expm1(-tau);
    }
  return lost;
}

TEST(Energy, BeamAlongAnAxisGivesUpExactlyWhatItLoses) {
  for (int axis = 0; axis < 3; ++axis)
    for (int sign : {-1, 1})
      for (double h : {0.1, 1.0, 10.0}) {
        const Medium medium = lumpyMedium(Vec3d(0.8), Vec3d(0.1), 0, h);
        Vec3d d(0);
        d[axis] = sign;
        DiffuseSettings settings;
        settings.tolerance = 1e-5;
        const DiffuseResult result = diffuse(medium, sunScene(d), settings);
        const double lost = lostFromAxisBeam(medium, axis);
        EXPECT_NEAR(power(medium, Vec3d(0.9), result.direct), lost, 1e-6 * lost) << "axis " << axis;
        // The whole of it: what the beam loses is absorbed at once, absorbed later, or leaves.
        const double absorbed_at_once = power(medium, Vec3d(0.1), result.direct);
        EXPECT_NEAR(absorbed_at_once + result.energy.absorbed + result.energy.escaped, lost,
                    11 * settings.tolerance * lost)
            << "axis " << axis;
      }
}

TEST(Energy, DeltaEddingtonLosesNothingOfTheBeam) {
  Medium medium = lumpyMedium(Vec3d(0.8), Vec3d(0.1), 0.8);
  DiffuseSettings settings;
  settings.tolerance = 1e-5;
  const DiffuseResult result = diffuse(medium, sunScene(Vec3d(0, 1, 0)), settings);
  const double lost = lostFromAxisBeam(medium, 1);
  EXPECT_NEAR(power(medium, Vec3d(0.1), result.direct) + result.energy.absorbed + result.energy.escaped, lost,
              11 * settings.tolerance * lost);
}

// Off the axes four rays in each voxel stand for the beam. They lie in opposite pairs, so that the error is
// of second order in the voxel's optical depth; rays to one side of the centre would give 3 to 6 % at 1/4.
TEST(Energy, ObliqueBeamGivesUpWhatItLosesToSecondOrder) {
  const double h = 0.5;
  for (const Vec3d& d : {Vec3d(1, 2, -3), Vec3d(1, 0, -1), Vec3d(-2, 3, 1), Vec3d(0.1, 0.1, -1),
                         Vec3d(1, 1, 1), Vec3d(-1, -0.9, -0.5)})
    for (double tau : {0.25, 0.5, 1.0}) {
      const double sigma = tau / h;
      Medium medium = boxMedium(Coord(16, 20, 24), Transform::uniform(h), [](Coord) { return 1.0; });
      medium.optics.sigma_s = Vec3d(sigma);
      const FirstScatter light = firstScatter(medium, sunScene(d), Occluder({}), Model::kP1);
      const Vec3d n = d.unit();
      double lost = 0;  // the integral of 1 - exp(-tau) over the plane that faces the beam
      const Vec3d size(16 * h, 20 * h, 24 * h);
      constexpr int kGrid = 200;
      for (int a = 0; a < 3; ++a)  // through each of the three faces it enters by
        for (int i = 0; i < kGrid && n[a] != 0; ++i)
          for (int j = 0; j < kGrid; ++j) {
            Vec3d p(0);
            p[a] = n[a] > 0 ? 0 : size[a];
            p[(a + 1) % 3] = size[(a + 1) % 3] * (i + 0.5) / kGrid;
            p[(a + 2) % 3] = size[(a + 2) % 3] * (j + 0.5) / kGrid;
            double length = HUGE_VAL;
            for (int k = 0; k < 3; ++k)
              if (n[k] != 0) length = std::min(length, ((n[k] > 0 ? size[k] : 0) - p[k]) / n[k]);
            const double cell = size[(a + 1) % 3] * size[(a + 2) % 3] / (kGrid * kGrid);
            lost -= std::abs(n[a]) * cell * std::expm1(-sigma * length);
          }
      const double found = power(medium, Vec3d(sigma), light.direct);
      EXPECT_NEAR(found, lost, 0.1 * tau * tau * lost) << d << " at optical depth " << tau;
    }
}

}  // namespace
}  // namespace vdb_diffuse
