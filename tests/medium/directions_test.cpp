#include "medium/directions.h"

#include <gtest/gtest.h>

#include <cmath>

#include "medium/angular_basis.h"

namespace vdb_diffuse {
namespace {

using openvdb::Vec3d;

// Cosines and weights are printed with seven digits; and of order 16 mixed moments from degree 12 on, of
// which there are more than weights, are not matched exactly.
constexpr double kTableDigits = 2e-6;
constexpr int kOrders[] = {4, 6, 8, 12, 16};

/// Mean of x^a y^b z^c over the sphere: (a-1)!! (b-1)!! (c-1)!! / (a+b+c+1)!!, 0 for an odd exponent.
double meanOfMonomial(int a, int b, int c) {
  if (a % 2 || b % 2 || c % 2) return 0;
  const auto doubleFactorial = [](int n) {
    double product = 1;
    for (; n > 1; n -= 2) product *= n;
    return product;
  };
  return doubleFactorial(a - 1) * doubleFactorial(b - 1) * doubleFactorial(c - 1) /
         doubleFactorial(a + b + c + 1);
}

TEST(Directions, IntegratePolynomialsUpToTheirOrder) {
  for (int order : kOrders) {
    const DirectionSet set = levelSymmetric(order);
    ASSERT_EQ(set.size(), static_cast<size_t>(order * (order + 2)));
    for (int a = 0; a <= order; ++a)
      for (int b = 0; a + b <= order; ++b)
        for (int c = 0; a + b + c <= order; ++c) {
          double sum = 0;
          for (size_t n = 0; n < set.size(); ++n)
            sum += set.weight[n] * std::pow(set.s[n][0], a) * std::pow(set.s[n][1], b) *
                   std::pow(set.s[n][2], c);
          EXPECT_NEAR(sum, meanOfMonomial(a, b, c), kTableDigits)
              << "order " << order << ", x^" << a << " y^" << b << " z^" << c;
        }
  }
}

TEST(Directions, AreTheSameUnderTurnsAndMirrors) {
  for (int order : kOrders) {
    const DirectionSet set = levelSymmetric(order);
    const auto weightAt = [&](const Vec3d& s) {
      for (size_t n = 0; n < set.size(); ++n)
        if ((set.s[n] - s).length() < 1e-12) return set.weight[n];
      return 0.0;
    };
    for (size_t n = 0; n < set.size(); ++n) {
      const Vec3d& s = set.s[n];
      EXPECT_NEAR(s.length(), 1, 1e-14);
      EXPECT_GT(set.weight[n], 0);
      for (const Vec3d& image : {Vec3d(-s[0], s[1], s[2]), Vec3d(s[1], s[0], s[2]), Vec3d(s[1], s[2], s[0])})
        EXPECT_EQ(weightAt(image), set.weight[n]) << "order " << order << ", direction " << n;
    }
  }
}

TEST(AngularBasis, IsOrthonormalOverADirectionSet) {
  for (int order : kOrders) {  // products of two are of order 4 at most
    const DirectionSet set = levelSymmetric(order);
    double sum[kSecondOrder][kSecondOrder] = {}, mean[kSecondOrder] = {};
    for (size_t n = 0; n < set.size(); ++n) {
      double b[kSecondOrder];
      angularBasis(set.s[n], b);
      for (int i = 0; i < kSecondOrder; ++i) {
        mean[i] += set.weight[n] * b[i];
        for (int j = 0; j < kSecondOrder; ++j) sum[i][j] += set.weight[n] * b[i] * b[j];
      }
    }
    for (int i = 0; i < kSecondOrder; ++i) {
      EXPECT_NEAR(mean[i], 0, 10 * kTableDigits);
      for (int j = 0; j < kSecondOrder; ++j)
        EXPECT_NEAR(sum[i][j], i == j, 20 * kTableDigits) << order << ": " << i << ' ' << j;
    }
  }
}

// The addition theorem: sum over order l of b_k(s) b_k(t) = (2l+1) P_l(s.t). It is what makes a phase
// function one factor for each order.
TEST(AngularBasis, AddsUpToLegendrePolynomials) {
  const DirectionSet set = levelSymmetric(16);
  for (size_t n = 0; n < set.size(); n += 7)
    for (size_t m = 0; m < set.size(); m += 11) {
      double b[kSecondOrder], c[kSecondOrder], sum[3] = {};
      angularBasis(set.s[n], b);
      angularBasis(set.s[m], c);
      for (int k = 0; k < kSecondOrder; ++k) sum[orderOf(k)] += b[k] * c[k];
      const double x = set.s[n].dot(set.s[m]);
      EXPECT_NEAR(sum[1], 3 * x, 1e-13);
      EXPECT_NEAR(sum[2], 2.5 * (3 * x * x - 1), 1e-13);
    }
}

}  // namespace
}  // namespace vdb_diffuse
