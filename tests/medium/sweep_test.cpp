#include "medium/sweep.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "sweep_volumes.h"

namespace vdb_diffuse {
namespace {

double one(Coord) {
  return 1;
}

Transform boxes(const Vec3d& size) {
  return Transform(Vec3d(size[0], 0, 0), Vec3d(0, size[1], 0), Vec3d(0, 0, size[2]), Vec3d(0));
}

/// A lump with gaps, in voxels that are not cubes.
Medium stretchedLump() {
  return boxMedium(
      Coord(30, 19, 27), boxes(Vec3d(1, 0.5, 2)),
      [](Coord p) { return p[0] >= 9 && p[0] < 21 && p[1] < 9 ? -1 : lumpyDensity(p); }, Coord(-5, 3, 60));
}

TEST(Sweep, WhatRaysGainInVoxelsIsWhatEscapes) {
  const Medium cubes = boxMedium(Coord(20, 17, 19), Transform::uniform(0.3),
                                 [](Coord p) { return lumpyDensity(p); }),
               stretched = stretchedLump();
  for (const Medium* medium : {&cubes, &stretched})
    for (double extinction : {0.01, 1.0, 30.0, 1e5})
      for (int moments : {0, kFirstOrder, kSecondOrder}) {
        const SweepResult result =
            sweep(wavefrontOf(*medium), unevenSource(*medium, extinction, moments), moments);
        EXPECT_NEAR(sumOver(medium->topology(), result.divergence) / result.escaped, 1, 2e-5)
            << "extinction " << extinction << ", " << moments << " moments";
        EXPECT_GT(result.escaped, 0);
      }
}

/// The integral of exp(-t/mu) over mu from 0 to 1.
double secondExponentialIntegral(double t) {
  double sum = 0;
  constexpr int kParts = 1000;
  for (int n = 0; n < kParts; ++n) sum += std::exp(-t * kParts / (n + 0.5)) / kParts;
  return sum;
}

/// The same by the directions of a set.
double secondExponentialIntegral(double t, const DirectionSet& set) {
  double sum = 0;
  for (size_t n = 0; n < set.size(); ++n) sum += set.weight[n] * std::exp(-t / std::abs(set.s[n][2]));
  return sum;
}

// J = 1 in a uniform slab: the radiance at depth t in the direction of cosine mu is 1 - exp(-t/mu), its mean
// 1 - (E2(t) + E2(tau - t)) / 2. The box is so wide that no ray in its middle has come in by a side. A thin
// slab has its light in directions flatter than any of the set's, so there only the set's own E2 can be met.
TEST(Sweep, UniformSlabGlowsAsExponentialIntegralsSay) {
  constexpr int kLayers = 6, kWidth = 280, kDirections = 96;
  const Medium slab = boxMedium(Coord(kWidth, kWidth, kLayers), Transform(), one);
  const Topology& topology = slab.topology();
  const Wavefront wavefront = wavefrontOf(slab, kDirections);
  const DirectionSet set = halfRangeSet(kDirections);
  for (double tau : {0.1, 1.0, 4.0}) {
    const SweepResult result = sweep(wavefront, sourceOf(slab, tau / kLayers, one), 0);
    double mean = 0, exact_mean = 0;
    for (int k = 0; k < kLayers; ++k) {
      double voxel = 0, by_set = 0;  // rays meet neighbours at other heights: a patch of them
      for (int i = 0; i < 24 * 24; ++i)
        voxel += result.mean.at(topology, Coord(kWidth / 2 + i / 24 - 12, kWidth / 2 + i % 24 - 12, k)) /
                 (24 * 24);
      constexpr int kParts = 16;
      for (int n = 0; n < kParts; ++n) {
        const double t = tau * (k + (n + 0.5) / kParts) / kLayers;
        by_set += (1 - 0.5 * (secondExponentialIntegral(t, set) + secondExponentialIntegral(tau - t, set))) /
                  kParts;
        exact_mean += (1 - 0.5 * (secondExponentialIntegral(t) + secondExponentialIntegral(tau - t))) /
                      (kParts * kLayers);
      }
      EXPECT_NEAR(voxel, by_set, 0.005 * by_set) << "tau " << tau << " layer " << k;
      mean += voxel / kLayers;
    }
    if (tau >= 1) {
      EXPECT_NEAR(mean, exact_mean, 0.01 * exact_mean) << "tau " << tau;
    }
  }
}

TEST(Sweep, OpaqueMediumShinesAsItsSource) {
  const Medium medium = stretchedLump();
  const auto J = [](Coord p) { return 1 + hashed(p); };
  for (double extinction : {1e4, 1e7}) {
    const SweepResult result = sweep(wavefrontOf(medium), sourceOf(medium, extinction, J), 0);
    forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
      const double depth = extinction * 0.1 * medium.transform().meanVoxelSize();  // of the thinnest voxel
      EXPECT_NEAR(result.mean[i] / J(p), 1, 10 / depth + 2e-6) << p;
    });
  }
}

// No voxel can be brighter than the brightest source, and with light from everywhere all would be 1: what a
// voxel of a convex uniform body lacks is what a sky of radiance 1 would send in, 1 - escape probability. By
// reciprocity its mean over the body is the share of the body's own light that leaves.
TEST(Sweep, UniformSourceLacksWhatEscapes) {
  const Medium medium = stretchedLump();
  for (double extinction : {0.05, 1.0, 20.0}) {
    const SweepSource source = sourceOf(medium, extinction, one);
    const SweepResult result = sweep(wavefrontOf(medium), source, 0);
    double lacking = 0;
    forEachVoxel(medium.topology(), [&](Coord, size_t i) {
      EXPECT_GE(result.mean[i], 0);
      EXPECT_LE(result.mean[i], 1 + 2e-6);
      lacking += source.tau[i] * (1.0 - result.mean[i]);
    });
    EXPECT_NEAR(result.escaped / lacking, 1, 2e-5) << extinction;
  }
}

// Diffusion: deep in an opaque medium with J = c + G.x the light is I(s) = J - s.G/sigma, its vector mean
// -G/(3 sigma), and the rays gain in each voxel what they lose.
TEST(Sweep, LinearSourceDeepInsideSendsTheDiffusiveFlux) {
  for (const Vec3d& size : {Vec3d(1), Vec3d(2, 1, 0.5)}) {
    const Medium medium = boxMedium(Coord(24, 24, 24), boxes(size), one);
    const Vec3d G(0.01, -0.02, 0.015);  // per voxel
    for (double extinction : {6.0, 100.0}) {
      SweepSource source = sourceOf(medium, extinction, [&](Coord p) { return 2 + G.dot(p.asVec3d()); });
      for (int a = 0; a < 3; ++a) source.slope[a].fill(static_cast<float>(G[a]));
      const SweepResult result = sweep(wavefrontOf(medium), source, kFirstOrder, true);
      for (const Coord& p : {Coord(12, 12, 12), Coord(10, 13, 11)}) {
        for (int a = 0; a < 3; ++a)  // few rays cross each other in a voxel unevenly
          EXPECT_NEAR(result.slope[a].at(medium.topology(), p), G[a], 0.1 * G.length()) << "axis " << a;
        const double scale = 0.02 / (3 * extinction), rounding = 2e-6;
        for (int a = 0; a < 3; ++a)
          EXPECT_NEAR(result.moments[a].at(medium.topology(), p) / std::sqrt(3.0),
                      -G[a] / size[a] / (3 * extinction), 1e-3 * scale + rounding)
              << "axis " << a << ", extinction " << extinction;
        EXPECT_NEAR(result.divergence.at(medium.topology(), p), 0, 0.01 * 0.02 + rounding);
      }
    }
  }
}

TEST(Sweep, AnisotropicSourceHasItsOwnMoments) {
  const Medium medium = boxMedium(Coord(24, 24, 24), Transform(), one);
  for (int order : {kFirstOrder, kSecondOrder}) {
    SweepSource source = sourceOf(medium, 1e6, one, order);
    for (int k = 0; k < order; ++k) source.angular[k].fill(0.02f * static_cast<float>(k - 2.5));
    const SweepResult result = sweep(wavefrontOf(medium), source, order);
    ASSERT_EQ(result.moments.size(), static_cast<size_t>(order));
    const Coord p(12, 11, 13);
    EXPECT_NEAR(result.mean.at(medium.topology(), p), 1, 1e-5);
    for (int k = 0; k < order; ++k)
      EXPECT_NEAR(result.moments[k].at(medium.topology(), p), 0.02 * (k - 2.5), 1e-5) << k;
  }
}

/// The cloud's axes in another order, and each perhaps backward.
struct Turn {
  int axis[3];  // which of the cloud's axes each of the grid's is
  bool mirrored[3];
};

const Coord kSize(20, 17, 19);

struct Turned {
  Medium medium;
  SweepResult result;
};

Turned sweepTurned(const Turn& turn, int directions, const Coord& offset = Coord(0, 0, 0)) {
  Coord size;
  for (int a = 0; a < 3; ++a) size[a] = kSize[turn.axis[a]];
  const auto original = [&](Coord q) {
    Coord p;
    for (int a = 0; a < 3; ++a) p[turn.axis[a]] = turn.mirrored[a] ? size[a] - 1 - q[a] : q[a];
    return p;
  };
  Turned turned{boxMedium(
                    size, Transform(), [&](Coord q) { return lumpyDensity(original(q)); }, offset),
                {}};
  SweepSource source = sourceOf(
      turned.medium, 1, [&](Coord q) { return 1 + hashed(original(q - offset), 11); }, kFirstOrder);
  forEachVoxel(turned.medium.topology(), [&](Coord q, size_t i) {
    for (int a = 0; a < 3; ++a) {
      const Coord p = original(q - offset);
      const double sign = turn.mirrored[a] ? -1 : 1;
      source.slope[a][i] = static_cast<float>(sign * (hashed(p, 20 + turn.axis[a]) - 0.5));
      source.angular[a][i] = static_cast<float>(0.1 * sign * (hashed(p, 30 + turn.axis[a]) - 0.5));
    }
  });
  turned.result = sweep(wavefrontOf(turned.medium, directions), source, kFirstOrder, true);
  return turned;
}

/// Largest difference from the volume as it stands, of the mean, the divergence and the moments.
double differenceUnder(const Turn& turn, int directions, const Coord& offset = Coord(0, 0, 0)) {
  const Turned plain = sweepTurned({{0, 1, 2}, {}}, directions),
               turned = sweepTurned(turn, directions, offset);
  const auto place = [&](Coord p) {
    Coord q;
    for (int a = 0; a < 3; ++a)
      q[a] = offset[a] + (turn.mirrored[a] ? kSize[turn.axis[a]] - 1 - p[turn.axis[a]] : p[turn.axis[a]]);
    return q;
  };
  double difference = 0;
  const auto consider = [&](const Field<float>& a, Field<float> b, bool negated) {
    for (size_t i = 0; negated && i < b.size(); ++i) b[i] = -b[i];
    difference = std::max(difference,
                          largestDifference(plain.medium.topology(), a, turned.medium.topology(), b, place));
  };
  consider(plain.result.mean, turned.result.mean, false);
  consider(plain.result.divergence, turned.result.divergence, false);
  for (int a = 0; a < 3; ++a)
    for (const auto& [plain_axis, turned_axis] :
         {std::pair(&plain.result.moments[turn.axis[a]], &turned.result.moments[a]),
          std::pair(&plain.result.slope[turn.axis[a]], &turned.result.slope[a])})
      consider(*plain_axis, *turned_axis, turn.mirrored[a]);
  EXPECT_NEAR(turned.result.escaped / plain.result.escaped, 1, 1e-5 + 2 * difference);
  return difference;
}

constexpr double kRounding = 2e-5;

TEST(Sweep, MirroredVolumeIsLitTheSame) {
  for (int m = 1; m < 8; ++m)
    EXPECT_LT(differenceUnder({{0, 1, 2}, {(m & 1) != 0, (m & 2) != 0, (m & 4) != 0}}, 96), kRounding) << m;
}

TEST(Sweep, MovedVolumeIsLitTheSame) {
  for (const Coord& offset : {Coord(8, 16, -8), Coord(3, -5, 7), Coord(1 << 28, -(1 << 28), 5)})
    EXPECT_LT(differenceUnder({{0, 1, 2}, {}}, 96, offset), kRounding) << offset;
}

// A direction as near to one axis as to another would have its lattice across the first of them: turned, its
// rays would lie elsewhere. The sets have none.
TEST(Sweep, TurnedVolumeIsLitTheSame) {
  const Turn turns[] = {
      {{1, 0, 2}, {true, false, false}}, {{0, 2, 1}, {false, true, false}}, {{1, 2, 0}, {}}, {{2, 1, 0}, {}}};
  for (const Turn& turn : turns) {
    for (int directions : {96, 168})
      EXPECT_LT(differenceUnder(turn, directions), kRounding) << turn.axis[0] << turn.axis[1] << turn.axis[2];
  }
}

TEST(Sweep, NumberOfThreadsChangesNoBit) {
  const Medium medium = stretchedLump();
  const auto swept = [&](int threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                      threads < 2 ? 2 : threads);
    tbb::task_arena arena(threads);
    SweepResult result;
    arena.execute(
        [&] { result = sweep(wavefrontOf(medium), unevenSource(medium, 1, kFirstOrder), kFirstOrder); });
    return result;
  };
  const SweepResult a = swept(1), b = swept(2);
  EXPECT_EQ(largestDifference(medium.topology(), a.mean, b.mean), 0);
  EXPECT_EQ(largestDifference(medium.topology(), a.divergence, b.divergence), 0);
  for (int k = 0; k < kFirstOrder; ++k)
    EXPECT_EQ(largestDifference(medium.topology(), a.moments[k], b.moments[k]), 0);
  EXPECT_EQ(a.escaped, b.escaped);
}

}  // namespace
}  // namespace vdb_diffuse
