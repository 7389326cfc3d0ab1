#include <gtest/gtest.h>

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
