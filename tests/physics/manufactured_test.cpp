#include <gtest/gtest.h>

#include "diffusion/equation.h"
#include "multigrid/solve.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

// An exact solution is chosen, the source and the light that comes in through the faces follow from it, and
// the discrete system must give the solution back.

constexpr double kSigmaS = 1.5, kSigmaA = 0.3, kG = 0.4;
constexpr double kSigmaTr = kSigmaA + (1 - kG) * kSigmaS;
const Vec3d kBox(1.0, 1.5, 2.0);           // world units
const Vec3d kWave(2.1, -1.3, 1.7);         // of J, not commensurate with the box
const Vec3d kDensityWave(1.1, 2.3, -1.9);  // of rho

double rhoAt(const Vec3d& p) {
  return 1 + 0.5 * std::sin(kDensityWave.dot(p));
}
Vec3d gradientOfRho(const Vec3d& p) {
  return kDensityWave * (0.5 * std::cos(kDensityWave.dot(p)));
}
double D(double rho) {
  return 1 / (3 * kSigmaTr * rho);
}

double exactJ(const Vec3d& p) {
  return 2 + std::cos(kWave[0] * p[0]) * std::cos(kWave[1] * p[1]) * std::cos(kWave[2] * p[2]);
}
Vec3d gradientOfJ(const Vec3d& p) {
  Vec3d gradient(-1);
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < 3; ++i)
      gradient[a] *= i == a ? kWave[i] * std::sin(kWave[i] * p[i]) : std::cos(kWave[i] * p[i]);
  return gradient;
}
/// -div(D grad J) + sigma_a rho J
double sourceAt(const Vec3d& p) {
  const double rho = rhoAt(p), laplacian = -kWave.lengthSqr() * (exactJ(p) - 2);
  const double gradient_D = -D(rho) / rho * gradientOfRho(p).dot(gradientOfJ(p));
  return -D(rho) * laplacian - gradient_D + kSigmaA * rho * exactJ(p);
}
/// What comes in through a face with outward normal n: J + 2 D dJ/dn, zero for a vacuum.
double incomingAt(const Vec3d& p, const Vec3d& n) {
  return exactJ(p) + 2 * D(rhoAt(p)) * gradientOfJ(p).dot(n);
}

struct Errors {
  double rms, largest;
};

/// The box in n voxels along its shortest side, voxels `stretch` times longer along z.
Errors manufacturedError(int n, double stretch) {
  const double h = kBox[0] / n;
  const Coord size(n, 3 * n / 2, static_cast<int>(std::lround(2 * n / stretch)));
  const Transform transform(Vec3d(h, 0, 0), Vec3d(0, h, 0), Vec3d(0, 0, h * stretch),
                            Vec3d(0.5 * h, 0.5 * h, 0.5 * h * stretch));
  Medium medium = boxMedium(size, transform, [&](Coord p) { return rhoAt(transform.toWorld(p.asVec3d())); });
  medium.optics.sigma_s = Vec3d(kSigmaS);
  medium.optics.sigma_a = Vec3d(kSigmaA);
  medium.optics.g = kG;
  EquationSettings settings;
  settings.staircase = false;
  settings.cap = std::numeric_limits<double>::infinity();
  const ChannelOptics optics = channelOptics(medium.optics, 0, Model::kP1);
  const Equation e = formEquation(medium, optics, 0, Model::kP1, settings);

  const Topology& topology = medium.topology();
  const Vec3d step = transform.voxelSize();
  Field<float> b(topology);
  forEachVoxel(topology, [&](Coord p, size_t i) {
    const Vec3d centre = transform.toWorld(p.asVec3d());
    double flow = e.h * sourceAt(centre);  // the equation is divided by volume / h
    for (int a = 0; a < 3; ++a)
      for (int up = 0; up < 2; ++up) {
        if (p[a] != (up ? size[a] - 1 : 0)) continue;
        Vec3d n_out(0);
        n_out[a] = up ? 1 : -1;
        const double resistance = 0.5 * step[a] / D(medium.density.values[i]) + 2;
        flow += e.h / step[a] * incomingAt(centre + n_out * (0.5 * step[a]), n_out) / resistance;
      }
    b[i] = static_cast<float>(flow);
  });
  Multigrid multigrid(e.A);
  Field<double> x(topology);
  EXPECT_TRUE(solve(multigrid, b, x, {1e-8, 0, 400, {}}).converged);
  Errors errors{0, 0};
  forEachVoxel(topology, [&](Coord p, size_t i) {
    const double error = std::abs(x[i] - exactJ(transform.toWorld(p.asVec3d())));
    errors.rms += error * error;
    errors.largest = std::max(errors.largest, error);
  });
  errors.rms = std::sqrt(errors.rms / topology.activeVoxelCount());
  return errors;
}

TEST(Equation, ManufacturedSolutionReturnsAtSecondOrder) {
  for (double stretch : {1.0, 2.0}) {
    const Errors a = manufacturedError(16, stretch), b = manufacturedError(32, stretch),
                 c = manufacturedError(64, stretch);
    ::testing::Message errors;
    errors << "voxels 1:" << stretch << ", n 16, 32, 64: rms " << a.rms << ", " << b.rms << ", " << c.rms
           << "; largest " << a.largest << ", " << b.largest << ", " << c.largest;
    EXPECT_GT(std::log2(a.rms / b.rms), 1.9) << errors;
    EXPECT_GT(std::log2(b.rms / c.rms), 1.9) << errors;
    EXPECT_GT(std::log2(b.largest / c.largest), 1.8) << errors;
    EXPECT_LT(c.largest, 1e-3) << errors;
  }
}

// Nothing absorbs and nothing shines: the same flux passes both halves of a column, of densities 1e4 apart,
// and J is linear in each. With the harmonic mean of D across the jump the discrete solution is that.
TEST(Equation, JumpOfDensityIsExact) {
  for (int axis = 0; axis < 3; ++axis)
    for (bool dense_first : {false, true}) {
      Coord size(4);
      size[axis] = 20;
      const int jump = 11;  // not on a block's side
      const double rho[2] = {dense_first ? 100.0 : 0.01, dense_first ? 0.01 : 100.0}, h = 0.1;
      Medium medium = boxMedium(size, Transform::uniform(h), [&](Coord p) { return rho[p[axis] >= jump]; });
      const Topology& topology = medium.topology();
      const std::vector<Surface> mirrors{{"mirror", {}, Vec3d(1)}};
      auto walls = std::make_shared<Walls>();
      for (size_t b = 0; b < topology.blockCount(); ++b)
        for (auto it = topology.active(b).beginOn(); it; ++it) {
          const Coord p = topology.origin(b) + voxelLocal(static_cast<int>(it.pos()));
          for (int face = 0; face < 6; ++face)
            if (face / 2 != axis && p[face / 2] == (face % 2 ? 3 : 0))
              (*walls)[static_cast<int32_t>(b)].push_back(
                  {static_cast<uint16_t>(it.pos()), static_cast<uint8_t>(face), 0, 1.0f});
        }
      EquationSettings settings;
      settings.staircase = false;
      settings.cap = std::numeric_limits<double>::infinity();
      settings.walls = walls;
      settings.surfaces = &mirrors;
      const Equation e =
          formEquation(medium, channelOptics(medium.optics, 0, Model::kP1), 0, Model::kP1, settings);
      // In through the lower end: J - 2 D dJ/dz = 1. In series with everything: both surfaces 2, and the
      // length of each half over its D.
      const double per_D[2] = {3 * rho[0], 3 * rho[1]};
      const double flux = 1 / (4 + jump * h * per_D[0] + (20 - jump) * h * per_D[1]);
      Field<float> b(topology);
      forEachVoxel(topology, [&](Coord p, size_t i) {
        b[i] = p[axis] == 0 ? static_cast<float>(1 / (2 + 0.5 * h * per_D[0])) : 0.0f;
      });
      Multigrid multigrid(e.A);
      Field<double> x(topology);
      EXPECT_TRUE(solve(multigrid, b, x, {1e-8, 1e-8, 400, {}}).converged);
      double worst = 0;
      forEachVoxel(topology, [&](Coord p, size_t i) {
        const double depth = (p[axis] + 0.5) * h, first = std::min(depth, jump * h);
        const double J = 1 - flux * (2 + first * per_D[0] + (depth - first) * per_D[1]);
        worst = std::max(worst, std::abs(x[i] - J));
      });
      EXPECT_LT(worst, 1e-6) << "axis " << axis << (dense_first ? ", dense first" : ", thin first");
    }
}

}  // namespace
}  // namespace vdb_diffuse
