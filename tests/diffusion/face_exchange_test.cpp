#include "diffusion/face_exchange.h"

#include <gtest/gtest.h>

#include "diffusion/area_factor.h"
#include "diffusion/corner_light.h"
#include "diffusion/returned_light.h"
#include "multigrid/solve.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A medium of opaque voxels that only scatters, solved with what its faces send each other; means over them.
struct Exchanged {
  double entering = 0, net = 0;  ///< per area, of a mean radiance
  double depth = 0;              ///< of the sun's light that scatters below each: 3 |mu| J where it shines
  double centre = 0;             ///< mean intensity in the middle, once solved again
};

Exchanged exchange(const Medium& medium, const Scene& scene, const Vec3d& sun, Coord centre) {
  const Topology& topology = medium.topology();
  const Occluder nothing(scene.surfaces);
  const ChannelOptics optics = channelOptics(medium, 0, Model::kDefault);
  FirstScatterSettings first;
  first.want_shape = true;
  const FirstScatter light = firstScatter(medium, scene, nothing, Model::kDefault, first);
  const auto walls = std::make_shared<const Walls>();
  const FaceProbe probe(medium, nothing, scene.surfaces, *walls, offPlanes());
  double part = 0;
  EquationSettings settings;
  settings.cap = kInfinity;
  settings.walls = walls;
  settings.returned = std::make_shared<const Field<float>>(returnedLight(probe, optics, 0, &part));
  const Equation equation = formEquation(medium, optics, 0, Model::kDefault, settings);
  const FaceExchange faces(probe, equation, 1, part);

  BeamSource beams{&light.direct[0], nullptr, &light.shape[0]};
  const Field<float> gathered = gatherCornerLight(equation, medium, beams, 1);
  beams.gathered = &gathered;
  FaceValues heads;
  RightHandSide rhs = formRightHandSide(equation, medium, beams, &heads);
  Multigrid multigrid(equation.A);
  Field<double> x(topology);
  EXPECT_TRUE(solve(multigrid, rhs.b, x, {1e-6, 0, 400, {}}).converged);
  const FaceValues incoming = faces.incoming(beams, heads, x, {});

  Exchanged result;
  double count = 0;
  for (size_t b = 0; b < topology.blockCount(); ++b) {
    float area[kBlockVoxels];
    areaFactors(topology, Vec3d(1), b, area);
    for (size_t k = 0; k < equation.open[b].size(); ++k) {
      const OpenFace& face = equation.open[b][k];
      const double F = area[face.voxel] * settings.returned->block(b)[face.voxel];
      const double J = face.g * (x.block(b)[face.voxel] + heads[b][k]);
      const double mu = (face.face % 2 ? -1 : 1) * sun[face.face / 2];
      result.net += J;
      result.entering += 0.25 * incoming[b][k] + 0.5 * J * (1 / F - 1);
      if (mu > 0) result.depth += 3 * mu * J;
      count += 1;
    }
  }
  result.net /= count;
  result.entering /= count;
  result.depth /= count;
  addIncoming(equation, incoming, rhs);
  EXPECT_TRUE(solve(multigrid, rhs.b, x, {1e-6, 0, 400, {}}).converged);
  result.centre = x.at(topology, centre);
  return result;
}

Medium opaqueBall(int radius, double depth) {
  Medium ball = ballMedium(radius, 1);
  ball.optics.sigma_s = Vec3d(depth);
  return ball;
}

// Under an even sky as much light falls on every face, from the sky and from other faces together: a quarter
// of its radiance, in units of it. And everywhere inside the radiance is the sky's.
TEST(FaceExchange, UnderASkyFacesReceiveWhatTheSkyWouldSend) {
  Scene scene;
  scene.lights.push_back({"sky", DomeLight{Vec3d(1), nullptr, 0}});
  for (double depth : {20.0, 100.0}) {
    const Exchanged ball = exchange(opaqueBall(10, depth), scene, Vec3d(0), Coord(11, 11, 11));
    EXPECT_NEAR(ball.entering + ball.net, 0.25, 0.015) << depth;
    EXPECT_NEAR(ball.centre, 1, 0.08) << depth;
  }
}

// Of a beam of flux J that scatters below a face, at mu to its normal, P1 with the Marshak condition makes
// the mean intensity 2 J + 3 mu J deep below it, and 4 E of what else enters. Inside an opaque ball it is the
// mean of that over all faces. Without the exchange it is 12 to 17 % less.
TEST(FaceExchange, OpaqueStepsHoldTheLightOfEveryFace) {
  for (const Vec3d& direction : {Vec3d(0, 0, -1), Vec3d(1, 0.5, -1), Vec3d(0.31, -0.17, -1)})
    for (double depth : {30.0, 300.0}) {
      const Vec3d sun = direction.unit();
      const Exchanged ball = exchange(opaqueBall(20, depth), sunScene(sun), sun, Coord(21, 21, 21));
      const double level = 4 * ball.entering + 2 * ball.net + ball.depth;
      EXPECT_NEAR(ball.centre / level, 1, 0.06) << direction << " depth " << depth;
    }
}

// What comes in at one face of a voxel by itself goes out evenly by all, and through the middle flows half of
// what it brings.
TEST(FaceExchange, LightThatComesInFlowsThrough) {
  Medium medium = boxMedium(Coord(1, 1, 1), Transform::uniform(1), [](Coord) { return 1.0; });
  medium.optics.sigma_s = Vec3d(3);
  const Topology& topology = medium.topology();
  EquationSettings settings;
  settings.cap = kInfinity;
  const Equation equation =
      formEquation(medium, channelOptics(medium, 0, Model::kDefault), 0, Model::kDefault, settings);
  ASSERT_EQ(equation.open[0].size(), 6u);
  const double g = equation.open[0][0].g;
  for (int in = 0; in < 6; ++in) {
    FaceValues incoming{std::vector<float>(6, 0.0f)};
    incoming[0][in] = 2;
    const Field<float> dark(topology);
    BeamSource beams{&dark};
    RightHandSide rhs = formRightHandSide(equation, medium, beams);
    addIncoming(equation, incoming, rhs);
    EXPECT_NEAR(rhs.drive_out, -2 * g, 1e-6);
    Multigrid multigrid(equation.A);
    Field<double> x(topology);
    EXPECT_TRUE(solve(multigrid, rhs.b, x, {1e-6, 0, 400, {}}).converged);
    EXPECT_NEAR(x.at(topology, Coord(0)), 2.0 / 6, 1e-5);
    beams.incoming = &incoming;
    VectorField flux;
    for (Field<float>& component : flux) component = Field<float>(topology);
    diffusiveFlux(equation, medium, x, beams, &flux);
    const int face = equation.open[0][in].face;
    for (int a = 0; a < 3; ++a)
      EXPECT_NEAR(flux[a].at(topology, Coord(0)), a == face / 2 ? (face % 2 ? -g : g) : 0, 1e-5) << face;
  }
}

TEST(FaceExchange, ThinMediaDoWithout) {
  Medium medium = boxMedium(Coord(4, 4, 4), Transform::uniform(0.5), [](Coord) { return 1.0; });
  const auto share = [&](double sigma_s) {
    medium.optics.sigma_s = Vec3d(sigma_s);
    return FaceExchange::shareOf(medium, channelOptics(medium, 0, Model::kDefault));
  };
  EXPECT_EQ(share(4.4), 0);
  EXPECT_NEAR(share(5.25), 0.5, 1e-6);
  EXPECT_EQ(share(6.1), 1);
}

}  // namespace
}  // namespace vdb_diffuse
