#include <gtest/gtest.h>

#include <cmath>

#include "diffusion/first_scatter.h"
#include "medium/sweep.h"
#include "transport/illuminate.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

// Under an even sky of radiance 1 a medium that only scatters holds the radiance 1 everywhere, so that what
// has scattered is as steep in each voxel as what has not, the other way.

Scene evenSky() {
  Scene scene;
  scene.lights.push_back({"sky", DomeLight{Vec3d(1), nullptr, 0}});
  return scene;
}

Medium ball(double depth) {
  Medium medium = ballMedium(9, 1);
  medium.optics.sigma_s = Vec3d(depth);
  return medium;
}

TEST(SweptSlopes, AreTheSkysTheOtherWay) {
  for (double depth : {0.2, 0.5, 1.0, 2.0, 3.0}) {
    const Medium medium = ball(depth);
    const Topology& topology = medium.topology();
    FirstScatterSettings settings;
    settings.want_shape = true;
    const FirstScatter sky = firstScatter(medium, evenSky(), Occluder({}), Model::kDefault, settings);
    SweepSource source;
    source.tau = source.J = Field<float>(topology);
    for (Field<float>& component : source.slope) component = Field<float>(topology);
    forEachVoxel(topology, [&](Coord, size_t i) {
      source.tau[i] = static_cast<float>(depth);
      source.J[i] = 1;
    });
    const SweepResult swept =
        sweep(Wavefront(medium.density.topology, Vec3d(1), halfRangeSet(168)), source, 0, true);
    double product = 0, square = 0;
    forEachVoxel(topology, [&](Coord, size_t i) {
      for (int a = 0; a < 3; ++a) {
        const double of_sky = 12 * sky.shape[0].lean[a][i];
        product += of_sky * swept.slope[a][i];
        square += of_sky * of_sky;
      }
    });
    EXPECT_NEAR(product / square, -1, 0.1) << depth << " optical depths a voxel";
  }
}

/// Where nothing comes in, light decays as exp(-kappa x), with (albedo / kappa) atanh(kappa) = 1 for x in mean
/// free paths.
double decayPerPath(double albedo) {
  double low = 0.01, high = 1 - 1e-12;
  for (int n = 0; n < 100; ++n) {
    const double middle = 0.5 * (low + high);
    (albedo / middle * std::atanh(middle) < 1 ? low : high) = middle;
  }
  return low;
}

// A source that decays so makes light that does. The swept slope of one voxel has to be that of the decay,
// although none of the rays that pass the voxel sees more of it than a line.
TEST(SweptSlopes, AreThoseOfTheDecay) {
  const double albedo = 0.99;
  const int width = 32, middle = width / 2;
  const Medium medium = boxMedium(Coord(width), Transform::uniform(1), [](Coord) { return 1.0f; });
  const Topology& topology = medium.topology();
  for (double depth : {0.5, 1.0, 2.0, 4.0}) {
    const double kappa = depth * decayPerPath(albedo);
    // mean and slope of exp(-kappa z) in the voxel about z
    const auto decayed = [&](int z) { return std::exp(-kappa * (z - middle)); };
    const double mean = std::sinh(0.5 * kappa) / (0.5 * kappa),
                 slope = 12 / kappa * (mean - std::cosh(0.5 * kappa));
    SweepSource source;
    source.tau = Field<float>(topology, static_cast<float>(depth));
    source.J = Field<float>(topology);
    for (Field<float>& component : source.slope) component = Field<float>(topology);
    forEachVoxel(topology, [&](Coord p, size_t i) {
      source.J[i] = static_cast<float>(albedo * mean * decayed(p[2]));
      source.slope[2][i] = static_cast<float>(albedo * slope * decayed(p[2]));
    });
    const SweepResult swept =
        sweep(Wavefront(medium.density.topology, Vec3d(1), halfRangeSet(96)), source, 0, true);
    for (int z = middle - 2; z < middle + 2; ++z) {
      const Coord p(middle - 3, middle + 1, z);
      EXPECT_NEAR(swept.mean.at(topology, p), mean * decayed(z), 0.01 * mean * decayed(z)) << depth;
      EXPECT_NEAR(swept.slope[2].at(topology, p), slope * decayed(z), -0.03 * slope * decayed(z)) << depth;
      for (int axis = 0; axis < 2; ++axis)
        EXPECT_NEAR(swept.slope[axis].at(topology, p), 0, -0.03 * slope * decayed(z)) << depth;
    }
  }
}

TEST(SweptSlopes, LetThickVoxelsFillTheFurnace) {
  for (double depth : {2.0, 4.0}) {
    const Medium medium = ball(depth);
    TransportSettings transport;
    transport.sweeps = 8;
    const DiffuseResult lit = illuminate(medium, evenSky(), {}, transport);
    double sum = 0;
    forEachVoxel(medium.topology(), [&](Coord, size_t i) { sum += lit.direct[0][i] + lit.diffuse[0][i]; });
    EXPECT_NEAR(sum / static_cast<double>(medium.topology().activeVoxelCount()), 1, 0.04)
        << depth << " optical depths a voxel";
  }
}

}  // namespace
}  // namespace vdb_diffuse
