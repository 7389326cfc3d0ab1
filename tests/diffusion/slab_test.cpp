#include <gtest/gtest.h>

#include "diffusion/equation.h"
#include "multigrid/solve.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

struct Slab {
  double tau, albedo, g;
  std::array<double, 6> J;  // at 0, .1, .25, .5, .75, 1 of tau, from the side of the light
  double R, T;
};

// Closed forms of P1 with the Marshak condition for a beam of irradiance 1 along the normal: the general
// solution A e^kx + B e^-kx + C e^-x of the two-moment equations, its constants from the condition at either
// side.
const Slab kSlabs[] = {
    {10, 1, 0, {0.135750, 0.251550, 0.267118, 0.197337, 0.111045, 0.023398}, 0.852943, 0.147057},
    {10, .99, .5, {0.099738, 0.207203, 0.216868, 0.153373, 0.087990, 0.029647}, 0.626675, 0.186326},
    {10, .9, .85, {0.002406, 0.101803, 0.109538, 0.064822, 0.033160, 0.015293}, 0.015118, 0.096134},
    {50, 1, .85, {0.129126, 0.332467, 0.283400, 0.198944, 0.114486, 0.030029}, 0.811321, 0.188679},
    {50, .99, 0, {0.120399, 0.151487, 0.041772, 0.004792, 0.000544, 0.000013}, 0.756490, 0.000082}};

struct SlabResult {
  std::array<double, 6> J;
  double R, T;
  int iterations;
  std::vector<double> means;  // by layer, from the side of the light
};

/// A column of 1 x 1 x n voxels with mirrors on its sides, lit from above.
SlabResult solveSlab(const Slab& slab, int n, Model model = Model::kP1, bool profile = false) {
  const double h = slab.tau / n;
  Medium medium = boxMedium(Coord(1, 1, n), Transform::uniform(h), [](Coord) { return 1.0; });
  medium.optics.sigma_s = Vec3d(slab.albedo);
  medium.optics.sigma_a = Vec3d(1 - slab.albedo);
  medium.optics.g = slab.g;
  const Topology& topology = medium.topology();

  const std::vector<Surface> mirrors{{"mirror", {}, Vec3d(1)}};
  auto walls = std::make_shared<Walls>();
  for (size_t b = 0; b < topology.blockCount(); ++b)
    for (auto it = topology.active(b).beginOn(); it; ++it)
      for (uint8_t face = 0; face < 4; ++face)
        (*walls)[static_cast<int32_t>(b)].push_back({static_cast<uint16_t>(it.pos()), face, 0, 1.0f});
  EquationSettings settings;
  settings.staircase = false;
  settings.profile = profile;
  settings.cap = std::numeric_limits<double>::infinity();
  settings.walls = walls;
  settings.surfaces = &mirrors;

  const ChannelOptics optics = channelOptics(medium.optics, 0, model);
  const Equation equation = formEquation(medium, optics, 0, model, settings);
  Scene sun;
  sun.lights.push_back({"sun", SunLight{Vec3d(0, 0, -1), Vec3d(1), 0}});
  FirstScatterSettings first;
  first.want_flux = true;
  first.want_shape = settings.profile;
  const FirstScatter light = firstScatter(medium, sun, Occluder({}), model, first);
  const VectorField* flux = &light.beam_flux[0];
  const RightHandSide rhs = formRightHandSide(
      equation, medium, {&light.direct[0], flux, settings.profile ? &light.shape[0] : nullptr});
  Multigrid multigrid(equation.A);
  Field<double> x(topology);
  const SolveReport report = solve(multigrid, rhs.b, x, {1e-8, 0, 400, {}});
  EXPECT_TRUE(report.converged);
  meansOfSolution(equation, medium, x);

  SlabResult result;
  for (int k = n - 1; k >= 0; --k) result.means.push_back(x.at(topology, Coord(0, 0, k)));
  result.iterations = report.iterations;
  const auto J = [&](int k) { return x.at(topology, Coord(0, 0, k)); };
  const double fractions[] = {0, .1, .25, .5, .75, 1};
  for (int i = 0; i < 6; ++i) {  // cubic between the four nearest voxels' centres; depth is n - 1/2 - k
    const double at = n - 0.5 - fractions[i] * n;
    const int k = std::min(std::max(static_cast<int>(std::floor(at)) - 1, 0), n - 4);
    double value = 0;
    for (int p = 0; p < 4; ++p) {
      double weight = 1;
      for (int q = 0; q < 4; ++q)
        if (q != p) weight *= (at - (k + q)) / (p - q);
      value += weight * J(k + p);
    }
    result.J[i] = value;
  }
  // Out through the ends: (I0 + (h/2) q.n) / (r + 2), times 4 pi for the flux of radiance.
  const double r = 1.5 * h * optics.sigma_tr, D3 = optics.sigma_s * 3 * optics.g * h;
  const auto q = [&](int k) { return D3 * (*flux)[2].at(topology, Coord(0, 0, k)); };
  result.R = 4 * M_PI * (J(n - 1) + 0.5 * q(n - 1)) / (r + 2);
  result.T = 4 * M_PI * (J(0) - 0.5 * q(0)) / (r + 2) + std::exp(-slab.tau);
  return result;
}

TEST(Slab, MatchesTheClosedFormAtSecondOrder) {
  for (const Slab& slab : kSlabs) {
    const SlabResult coarse = solveSlab(slab, 256), fine = solveSlab(slab, 1024);
    const double largest = *std::max_element(slab.J.begin(), slab.J.end());
    for (int i = 0; i < 6; ++i) {
      const double h = slab.tau / 1024;  // the error is of second order; the table has six decimals
      EXPECT_NEAR(fine.J[i], slab.J[i], 0.3 * h * h * largest + 1e-6)
          << "tau " << slab.tau << " g " << slab.g << " at " << i;
    }
    EXPECT_NEAR(fine.R, slab.R, 2e-4);
    EXPECT_NEAR(fine.T, slab.T, 2e-4);
    EXPECT_LT(std::abs(fine.J[1] - slab.J[1]), std::abs(coarse.J[1] - slab.J[1]) / 8 + 2e-6);
  }
}

TEST(Slab, ErrorFallsWithTheSquareOfTheVoxelSize) {
  for (const Slab& slab : kSlabs) {
    if (slab.tau > 10) continue;
    const SlabResult a = solveSlab(slab, 64), b = solveSlab(slab, 128), c = solveSlab(slab, 256);
    for (int i : {1, 2, 3, 4}) {
      const double order = std::log2(std::abs((a.J[i] - b.J[i]) / (b.J[i] - c.J[i])));
      EXPECT_GT(order, 1.9) << "g " << slab.g << " at " << i;
    }
  }
}

// A voxel's value is the mean over it, however thick it is: those of thin layers together are those of thick
// ones. Without absorption that is exact; the weight of a beam's light within an absorbing voxel is a
// parabola where it should be a cosh.
TEST(Slab, ThickVoxelsHaveTheirMeans) {
  for (double albedo : {1.0, 0.99, 0.9})
    for (double depth : {1.0, 3.0, 10.0}) {
      constexpr int kLayers = 6, kParts = 200;
      const Slab slab{depth * kLayers, albedo, 0, {}, 0, 0};
      const SlabResult thick = solveSlab(slab, kLayers, Model::kP1, true),
                       thin = solveSlab(slab, kLayers * kParts);
      for (int k = 0; k < kLayers; ++k) {
        double mean = 0;
        for (int n = 0; n < kParts; ++n) mean += thin.means[k * kParts + n] / kParts;
        const double inexact = albedo == 1 ? 2e-4 : albedo == 0.99 ? 0.03 : 0.1;
        EXPECT_NEAR(thick.means[k], mean, inexact * thick.means[0])
            << "albedo " << albedo << ", depth " << depth << ", layer " << k;
      }
    }
}

// Away from its source, light in an infinite medium decays as exp(-k x), k = sqrt(sigma_a / D): 0.5477 at
// albedo 0.9 in units of sigma_t. The paper's printed kappa is 3 D, and gives 0.3162.
TEST(Equation, DecayLengthMatchesP1) {
  Slab slab{40, 0.9, 0, {}, 0, 0};
  const auto decay = [&](Model model) {
    const SlabResult r = solveSlab(slab, 800, model);
    return std::log(r.J[3] / r.J[4]) / (0.25 * slab.tau);  // between tau 20 and 30
  };
  EXPECT_NEAR(decay(Model::kP1), 0.5477, 0.0005);
  EXPECT_NEAR(decay(Model::kPaper), 0.3162, 0.0005);
}

}  // namespace
}  // namespace vdb_diffuse
