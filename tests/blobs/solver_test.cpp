#include "blobs/solver.h"

#include <gtest/gtest.h>

namespace vdb_diffuse {
namespace {

/// The matrix (-1, 2, -1), scaled row by row and column by column by different factors; with `closed` its
/// first and last row add up to zero as well.
BlobSystem chain(int n, bool closed) {
  BlobSystem system;
  const auto factor = [](int i) { return 1 + 3 * (i % 5); };
  system.first.push_back(0);
  for (int j = 0; j < n; ++j) {
    for (int i = std::max(0, j - 1); i <= std::min(n - 1, j + 1); ++i) {
      const bool end = closed && (j == 0 || j == n - 1);
      system.column.push_back(i);
      system.value.push_back((i == j ? (end ? 1 : 2) : -1) * factor(i) * factor(j));
    }
    system.first.push_back(system.column.size());
    system.volume.push_back(1);
  }
  return system;
}

double residual(const BlobSystem& s, const std::vector<double>& x, const std::vector<double>& b) {
  double worst = 0;
  for (size_t j = 0; j < s.size(); ++j) {
    double sum = -b[j];
    for (size_t e = s.first[j]; e < s.first[j + 1]; ++e) sum += s.value[e] * x[s.column[e]];
    worst = std::max(worst, std::abs(sum));
  }
  return worst;
}

// The chain's eigenvalues are 2 - 2 cos(k pi/(n+1)); of its inverse the middle column is the largest. LU
// tells the condition number in the sum norm, (n+1)^2/2, conjugate gradients in the Euclidean one,
// cot^2(pi/(2 (n+1))).
TEST(BlobSolver, KnowsTheConditionNumberOfAChain) {
  for (const int n : {99, 799}) {
    const BlobSystem system = chain(n, false);
    std::vector<double> b(system.size(), 0.0);
    b[n / 3] = 1;
    BlobSolveReport report;
    const std::vector<double> x = BlobSolver(system, BlobForm::kGalerkin).solve(b, 1e-10, report);
    EXPECT_LT(residual(system, x, b), 1e-8);
    const double cot = 1 / std::tan(M_PI / (2 * (n + 1)));
    const double known = n <= kDenseBlobs ? 0.5 * (n + 1) * (n + 1) : cot * cot;
    EXPECT_NEAR(report.condition_number, known, 0.02 * known) << n;
    EXPECT_TRUE(report.converged);
    EXPECT_FALSE(report.regularised);
    EXPECT_EQ(report.iterations > 1, n > kDenseBlobs);
  }
}

TEST(BlobSolver, SaysThatASingularSystemIsRegularised) {
  for (const int n : {50, 800}) {
    const BlobSystem system = chain(n, true);
    BlobSolveReport report;
    const std::vector<double> x =
        BlobSolver(system, BlobForm::kGalerkin).solve(std::vector<double>(system.size(), 1.0), 1e-8, report);
    EXPECT_TRUE(report.regularised) << n;
    EXPECT_GT(report.condition_number, kWorstCondition);
    for (const double v : x) EXPECT_TRUE(std::isfinite(v));
  }
}

TEST(BlobSolver, WithoutLightThereIsNoLight) {
  BlobSolveReport report;
  for (const double v :
       BlobSolver(chain(10, false), BlobForm::kCollocation).solve(std::vector<double>(10, 0.0), 1e-6, report))
    EXPECT_EQ(v, 0);
  EXPECT_EQ(report.iterations, 0);
}

}  // namespace
}  // namespace vdb_diffuse
