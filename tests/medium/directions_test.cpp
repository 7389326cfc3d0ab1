#include "medium/directions.h"

#include <gtest/gtest.h>

#include <cmath>

#include "medium/angular_basis.h"

namespace vdb_diffuse {
namespace {

using openvdb::Vec3d;

constexpr double kTableDigits = 1e-13;
constexpr struct { int size, degree; } kSets[] = {{96, 5}, {168, 9}};

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

void expectExactUpTo(int degree, const DirectionSet& set) {
  for (int a = 0; a <= degree; ++a)
    for (int b = 0; a + b <= degree; ++b)
      for (int c = 0; a + b + c <= degree; ++c) {
        double sum = 0;
        for (size_t n = 0; n < set.size(); ++n)
          sum +=
              set.weight[n] * std::pow(set.s[n][0], a) * std::pow(set.s[n][1], b) * std::pow(set.s[n][2], c);
        EXPECT_NEAR(sum, meanOfMonomial(a, b, c), kTableDigits)
            << set.size() << " directions, x^" << a << " y^" << b << " z^" << c;
      }
}

TEST(Directions, IntegratePolynomialsUpToTheirDegree) {
  for (const auto& [size, degree] : kSets) {
    const DirectionSet set = halfRangeSet(size);
    ASSERT_EQ(set.size(), static_cast<size_t>(size));
    expectExactUpTo(degree, set);
  }
}

TEST(Directions, HalfOfThoseOffThePlanesAreAsExact) {
  const DirectionSet all = offPlanes(), half = offPlanesInRings();
  ASSERT_EQ(all.size(), 48u);
  ASSERT_EQ(half.size(), 24u);
  expectExactUpTo(5, all);
  expectExactUpTo(5, half);
}

// Light that comes evenly from half the sphere sends a quarter of its radiance through a plane; E3 and E2 are
// what is left of that flux and of the mean behind a slab.
TEST(Directions, HaveTheFluxOfHalfTheSphere) {
  constexpr struct {
    int size;
    double of_flux, of_mean;
  } kErrors[] = {{96, 0.007, 0.005}, {168, 0.0002, 0.0002}};
  for (const auto& [size, of_flux, of_mean] : kErrors) {
    const DirectionSet set = halfRangeSet(size);
    const auto half = [&](const Vec3d& n, auto&& f) {
      double sum = 0;
      for (size_t i = 0; i < set.size(); ++i)
        if (const double mu = set.s[i].dot(n); mu > 0) sum += set.weight[i] * f(mu);
      return sum;
    };
    const auto exact = [](auto&& f) {
      constexpr int kParts = 20000;
      double sum = 0;
      for (int n = 0; n < kParts; ++n) sum += f((n + 0.5) / kParts);
      return 0.5 * sum / kParts;
    };
    EXPECT_NEAR(half(Vec3d(0, 0, 1), [](double mu) { return mu; }), 0.25, 1e-12) << size;
    for (const Vec3d& diagonal : {Vec3d(1, 1, 0), Vec3d(1, 1, 1)})
      EXPECT_NEAR(half(diagonal.unit(), [](double mu) { return mu; }), 0.25, 0.0002) << size;
    for (double tau : {0.1, 0.3, 1.0, 3.0}) {
      const auto flux = [&](double mu) { return mu * std::exp(-tau / mu); };
      const auto mean = [&](double mu) { return std::exp(-tau / mu); };
      EXPECT_NEAR(half(Vec3d(0, 0, 1), flux) / exact(flux), 1, of_flux) << size << ", tau " << tau;
      EXPECT_NEAR(half(Vec3d(0, 0, 1), mean) / exact(mean), 1, of_mean) << size << ", tau " << tau;
    }
  }
}

TEST(Directions, AreTheSameUnderTurnsAndMirrors) {
  for (const auto& [size, degree] : kSets) {
    const DirectionSet set = halfRangeSet(size);
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
        EXPECT_EQ(weightAt(image), set.weight[n]) << size << " directions, " << n;
    }
  }
}

TEST(AngularBasis, IsOrthonormalOverADirectionSet) {
  for (const auto& [size, degree] : kSets) {  // products of two are of degree 4 at most
    const DirectionSet set = halfRangeSet(size);
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
        EXPECT_NEAR(sum[i][j], i == j, 20 * kTableDigits) << size << ": " << i << ' ' << j;
    }
  }
}

// The addition theorem: sum over order l of b_k(s) b_k(t) = (2l+1) P_l(s.t). It is what makes a phase
// function one factor for each order.
TEST(AngularBasis, AddsUpToLegendrePolynomials) {
  const DirectionSet set = halfRangeSet(168);
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
