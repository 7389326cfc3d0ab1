#include <gtest/gtest.h>

#include "diffusion/equation.h"
#include "multigrid/solve.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

std::shared_ptr<const Operator> plainOperator(const Medium& medium, double cap = kNone) {
  EquationSettings settings;
  settings.staircase = false;
  settings.cap = cap;
  return formEquation(medium, channelOptics(medium.optics, 0, Model::kP1), 0, Model::kP1, settings).A;
}

/// A network on a few hundred scattered voxels, half resistances spread over `contrast`, sinks likewise.
Operator randomNetwork(double contrast) {
  const Medium medium = boxMedium(
      Coord(13, 11, 9), Transform(), [](Coord p) { return lumpyDensity(p); }, Coord(-6, 3, 5));
  Operator A;
  A.topology = medium.density.topology;
  A.half_resistance = Field<float>(*A.topology, std::numeric_limits<float>::infinity());
  A.sink = Field<float>(*A.topology);
  forEachVoxel(*A.topology, [&](Coord p, size_t i) {
    A.half_resistance[i] = static_cast<float>(std::pow(contrast, hashed(p, 1) - 0.5));
    A.sink[i] = static_cast<float>(0.1 * hashed(p, 2) * std::pow(contrast, -hashed(p, 3)));
  });
  formDiagonal(A);
  return A;
}

/// The same system assembled as a dense matrix from the drawing in operator.h, and its Cholesky solution.
std::vector<double> denseSolution(const Operator& A, const Field<float>& b, std::vector<size_t>& index) {
  std::vector<Coord> voxels;
  forEachVoxel(*A.topology, [&](Coord p, size_t i) {
    voxels.push_back(p);
    index.push_back(i);
  });
  const size_t n = voxels.size();
  std::vector<double> M(n * n, 0.0), x(n);
  for (size_t i = 0; i < n; ++i) {
    M[i * n + i] += A.sink[index[i]];
    x[i] = b[index[i]];
    for (size_t j = 0; j < i; ++j) {
      const Coord d = voxels[i] - voxels[j];
      if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] != 1) continue;
      const double g = 1 / (static_cast<double>(A.half_resistance[index[i]]) + A.half_resistance[index[j]]);
      M[i * n + i] += g;
      M[j * n + j] += g;
      M[i * n + j] -= g;
    }
  }
  for (size_t j = 0; j < n; ++j)  // M = L L^T in place of the lower half
    for (size_t i = j; i < n; ++i) {
      double sum = M[i * n + j];
      for (size_t k = 0; k < j; ++k) sum -= M[i * n + k] * M[j * n + k];
      M[i * n + j] = i == j ? std::sqrt(sum) : sum / M[j * n + j];
    }
  for (size_t i = 0; i < n; ++i) {
    for (size_t k = 0; k < i; ++k) x[i] -= M[i * n + k] * x[k];
    x[i] /= M[i * n + i];
  }
  for (size_t i = n; i-- > 0;) {
    for (size_t k = i + 1; k < n; ++k) x[i] -= M[k * n + i] * x[k];
    x[i] /= M[i * n + i];
  }
  return x;
}

TEST(Multigrid, MatchesADenseCholeskySolution) {
  for (double contrast : {1.0, 1e6}) {
    const auto A = std::make_shared<const Operator>(randomNetwork(contrast));
    Field<float> b(*A->topology);
    forEachVoxel(*A->topology, [&](Coord p, size_t i) { b[i] = static_cast<float>(hashed(p, 4)); });
    std::vector<size_t> index;
    const std::vector<double> exact = denseSolution(*A, b, index);
    const double largest = *std::max_element(exact.begin(), exact.end());
    for (size_t direct_unknowns : {size_t(0), size_t(50), size_t(100000)}) {
      CycleSettings cycle;
      cycle.direct_unknowns = direct_unknowns;
      Multigrid multigrid(A, cycle);
      Field<double> x(*A->topology);
      const SolveReport report = solve(multigrid, b, x, {1e-9, 0, 400, {}});
      EXPECT_TRUE(report.converged);
      double worst = 0;
      for (size_t i = 0; i < index.size(); ++i) worst = std::max(worst, std::abs(x[index[i]] - exact[i]));
      // What float coefficients and the tolerance leave.
      EXPECT_LT(worst, 1e-6 * largest)
          << "contrast " << contrast << ", direct below " << direct_unknowns << ", " << report.iterations
          << " iterations, residual " << report.relative_residual;
    }
  }
}

TEST(Multigrid, SolvesForAnotherFinestOperatorWithTheCoarseOnesOfTheFirst) {
  Operator wider = randomNetwork(1e3);
  const auto A = std::make_shared<const Operator>(wider);
  forEachVoxel(*A->topology, [&](Coord p, size_t i) { wider.sink[i] *= hashed(p, 7) < 0.3 ? 1.5f : 1.0f; });
  formDiagonal(wider);
  const auto B = std::make_shared<const Operator>(wider);
  Field<float> b(*A->topology);
  forEachVoxel(*A->topology, [&](Coord p, size_t i) { b[i] = static_cast<float>(hashed(p, 4)); });
  std::vector<size_t> index;
  const std::vector<double> exact = denseSolution(*B, b, index);
  const double largest = *std::max_element(exact.begin(), exact.end());
  for (size_t direct_unknowns : {size_t(50), size_t(100000)}) {
    CycleSettings cycle;
    cycle.direct_unknowns = direct_unknowns;
    Multigrid own(B, cycle), exchanged(A, cycle);
    exchanged.exchangeFinest(B);
    Field<double> x(*A->topology), y(*A->topology);
    const SolveReport usual = solve(own, b, x, {1e-8, 0, 100, {}}),
                      report = solve(exchanged, b, y, {1e-8, 0, 100, {}});
    EXPECT_TRUE(report.converged);
    EXPECT_LE(report.iterations, usual.iterations + 4);
    double worst = 0;
    for (size_t i = 0; i < index.size(); ++i) worst = std::max(worst, std::abs(y[index[i]] - exact[i]));
    EXPECT_LT(worst, 1e-5 * largest);
  }
}

SolveReport glowingBall(int width, size_t* levels = nullptr) {
  const double R = 5, h = 2 * R / width;
  Medium medium = ballMedium(R, h);
  medium.optics.sigma_a = Vec3d(1e-3);
  const auto A = plainOperator(medium);
  Field<float> b(*A->topology);
  forEachVoxel(*A->topology, [&](Coord, size_t i) { b[i] = 1; });
  Multigrid multigrid(A);
  if (levels) *levels = multigrid.levelCount();
  Field<double> x(*A->topology);
  return solve(multigrid, b, x, {1e-6, 0, 100, {}});
}

TEST(Multigrid, IterationsDoNotGrowWithTheGrid) {
  const SolveReport coarse = glowingBall(32), middle = glowingBall(64), fine = glowingBall(128);
  ::testing::Message counts;
  counts << "iterations at 32, 64, 128: " << coarse.iterations << ", " << middle.iterations << ", "
         << fine.iterations;
  EXPECT_TRUE(coarse.converged && middle.converged && fine.converged) << counts;
  EXPECT_LE(middle.iterations, coarse.iterations + 2) << counts;
  EXPECT_LE(fine.iterations, middle.iterations + 2) << counts;
  EXPECT_LE(fine.iterations, 15) << counts;
  RecordProperty("iterations", counts.GetString());
}

TEST(Multigrid, PreconditionerIsSymmetricAndPositive) {
  for (double contrast : {1.0, 1e6}) {
    const auto A = std::make_shared<const Operator>(randomNetwork(contrast));
    CycleSettings cycle;
    cycle.direct_unknowns = 20;
    Multigrid multigrid(A, cycle);
    Field<float> u(*A->topology), v(*A->topology), Mu(*A->topology), Mv(*A->topology);
    forEachVoxel(*A->topology, [&](Coord p, size_t i) {
      u[i] = static_cast<float>(hashed(p, 5) - 0.5);
      v[i] = static_cast<float>(hashed(p, 6) - 0.5);
    });
    multigrid.precondition(u, Mu);
    multigrid.precondition(v, Mv);
    double uMv = 0, vMu = 0, uMu = 0, vMv = 0;
    forEachVoxel(*A->topology, [&](Coord, size_t i) {
      uMv += static_cast<double>(u[i]) * Mv[i];
      vMu += static_cast<double>(v[i]) * Mu[i];
      uMu += static_cast<double>(u[i]) * Mu[i];
      vMv += static_cast<double>(v[i]) * Mv[i];
    });
    EXPECT_GT(uMu, 0);
    EXPECT_GT(vMv, 0);
    EXPECT_NEAR(uMv, vMu, 1e-5 * std::sqrt(uMu * vMv)) << "contrast " << contrast;
  }
}

TEST(Multigrid, ConvergesOnRawDensities) {
  Medium medium = boxMedium(Coord(40), Transform::uniform(0.5), [](Coord p) {
    return std::pow(10.0, -4 + 5 * hashed(p));  // 1e-4 .. 10, each voxel for itself
  });
  medium.optics.sigma_a = Vec3d(1e-3);
  const auto A = plainOperator(medium);
  Field<float> b(*A->topology);
  forEachVoxel(*A->topology, [&](Coord p, size_t i) {
    b[i] = static_cast<float>(medium.density.values[i] * hashed(p, 8));
  });
  Multigrid multigrid(A);
  Field<double> x(*A->topology);
  const SolveReport report = solve(multigrid, b, x, {1e-6, 1e-5, 400, {}});
  EXPECT_TRUE(report.converged);
  EXPECT_LE(report.iterations, 60);
  double least = 0, largest = 0;
  forEachVoxel(*A->topology, [&](Coord, size_t i) {
    least = std::min(least, x[i]);
    largest = std::max(largest, x[i]);
  });
  EXPECT_GE(least, -1e-6 * largest);  // the inverse of this matrix has no negative entry
  RecordProperty("iterations", report.iterations);
}

TEST(Multigrid, NoSourceNeedsNoIterations) {
  const auto A = std::make_shared<const Operator>(randomNetwork(10));
  Multigrid multigrid(A);
  Field<float> b(*A->topology);
  Field<double> x(*A->topology, 3.0);
  const SolveReport report = solve(multigrid, b, x);
  EXPECT_TRUE(report.converged);
  EXPECT_EQ(report.iterations, 0);
  for (size_t i = 0; i < x.size(); ++i) ASSERT_EQ(x[i], 0);
}

TEST(Multigrid, SaysSoWhenItRunsOutOfIterations) {
  const auto A = std::make_shared<const Operator>(randomNetwork(1e6));
  CycleSettings cycle;
  cycle.direct_unknowns = 0;
  Multigrid multigrid(A, cycle);
  Field<float> b(*A->topology);
  forEachVoxel(*A->topology, [&](Coord p, size_t i) { b[i] = static_cast<float>(hashed(p, 4)); });
  Field<double> x(*A->topology);
  const SolveReport report = solve(multigrid, b, x, {1e-9, 0, 1, {}});
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(report.iterations, 1);
  // What it claims is the residual of what it returns.
  Field<float> r(*A->topology);
  residual(*A, b, x, r);
  EXPECT_NEAR(report.relative_residual, std::sqrt(scaledNormSquared(*A, r) / scaledNormSquared(*A, b)),
              1e-6 * report.relative_residual);
}

}  // namespace
}  // namespace vdb_diffuse
