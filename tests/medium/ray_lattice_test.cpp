#include "medium/ray_lattice.h"

#include <gtest/gtest.h>

#include "medium/directions.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

constexpr double kRounding = 1e-6;  // places are floats of about one
const Coord kLowest(-16, 8, -24), kHighest(23, 31, 15);
const Vec3d kMiddle(2.5, 19, -4.5);

Vec3d randomDirection(int n) {
  const double z = 2 * hashed(Coord(n, 0, 0)) - 1, phi = 2 * M_PI * hashed(Coord(n, 1, 0));
  const double r = std::sqrt(1 - z * z);
  return Vec3d(r * std::cos(phi), r * std::sin(phi), z);
}

/// All directions of a set, ties and all, and some that lie anyhow; each in cubes and in stretched voxels.
template <typename Check>
void forLattices(const Check& check) {
  std::vector<Vec3d> directions = halfRangeSet(96).s;
  for (int n = 0; n < 60; ++n) directions.push_back(randomDirection(n));
  directions.push_back(Vec3d(0, 0, 1));  // along an axis: one step a layer
  directions.push_back(Vec3d(0, -1, 0));
  directions.push_back(Vec3d(1, -1, 0).unit());
  for (const Vec3d& s : directions)
    for (const Vec3d& stretch : {Vec3d(1), Vec3d(2, 1, 0.5), Vec3d(0.2, 0.2, 25)}) {
      SCOPED_TRACE(::testing::Message() << "s " << s << ", stretch " << stretch);
      check(makeRayLattice(s, 0.25, stretch, kLowest, kHighest, kMiddle), stretch);
    }
}

/// Where a step begins, in voxels along (w, u, v), for the ray (0, 0).
Vec3d beginningOf(const RayLattice&, int layer, const LayerStep& step) {
  return Vec3d(layer + step.enters[0], step.shift_u + step.enters[1], step.shift_v + step.enters[2]);
}
Vec3d movesOf(const LayerStep& step) {
  return Vec3d(step.moves[0], step.moves[1], step.moves[2]);
}

TEST(RayLattice, StepsJoinEndToEndFromLayerToLayer) {
  forLattices([](const RayLattice& lattice, const Vec3d& stretch) {
    ASSERT_EQ(static_cast<int>(lattice.layers.size()), kHighest[lattice.w] - kLowest[lattice.w] + 1);
    const Vec3d d = lattice.s / stretch;
    const Vec3d slope = Vec3d(d[lattice.w], d[lattice.u], d[lattice.v]) / std::abs(d[lattice.w]);
    const int first = lattice.sign > 0 ? kLowest[lattice.w] : kHighest[lattice.w];
    Vec3d end;
    for (int n = 0; n < static_cast<int>(lattice.layers.size()); ++n) {
      const int w = first + lattice.sign * n;
      const Layer& layer = lattice.layers[w - lattice.first_layer];
      ASSERT_GE(layer.steps, 1);
      double extent = 0;
      for (int k = 0; k < layer.steps; ++k) {
        const LayerStep& step = layer.step[k];
        const Vec3d begin = beginningOf(lattice, w, step);
        if (n > 0 || k > 0) {
          EXPECT_LT((begin - end).length(), 10 * kRounding) << "layer " << w << " step " << k;
        }
        EXPECT_LT((movesOf(step) - slope * step.extent).length(), kRounding);
        for (int a = 0; a < 3; ++a) {  // within its voxel, from side to side
          EXPECT_LE(std::abs(step.enters[a]), 0.5 + kRounding);
          EXPECT_LE(std::abs(step.enters[a] + step.moves[a]), 0.5 + kRounding);
        }
        EXPECT_NEAR(std::abs(step.enters[step.entered_by]), 0.5, 10 * kRounding);
        EXPECT_NEAR(std::abs(step.enters[step.left_by] + step.moves[step.left_by]), 0.5, 10 * kRounding);
        end = begin + movesOf(step);
        extent += step.extent;
      }
      EXPECT_NEAR(extent, 1, kRounding) << "layer " << w;
    }
  });
}

TEST(RayLattice, OneRayPassesThePointAskedFor) {
  forLattices([](const RayLattice& plain, const Vec3d& stretch) {
    for (double aside : {0.0, 0.17}) {
      Vec3d point = kMiddle;
      point[plain.u] += aside;
      point[plain.v] -= aside;
      const RayLattice lattice = makeRayLattice(plain.s, 0.25, stretch, kLowest, kHighest, point);
      const Vec3d middle(point[lattice.w], point[lattice.u], point[lattice.v]);
      double nearest = HUGE_VAL;
      for (size_t n = 0; n < lattice.layers.size(); ++n)
        for (int k = 0; k < lattice.layers[n].steps; ++k) {
          const LayerStep& step = lattice.layers[n].step[k];
          const Vec3d begin = beginningOf(lattice, lattice.first_layer + static_cast<int>(n), step),
                      moves = movesOf(step);
          const double along = std::clamp((middle - begin).dot(moves) / moves.lengthSqr(), 0.0, 1.0);
          nearest = std::min(nearest, (begin + moves * along - middle).length());
        }
      EXPECT_LT(nearest, 1e-5) << "aside " << aside;
    }
  });
}

TEST(RayLattice, EveryVoxelFindsItsRaysInThePlane) {
  forLattices([](const RayLattice& lattice, const Vec3d&) {
    for (const Layer& layer : lattice.layers)
      for (int k = 0; k < layer.steps; ++k)
        for (int u : {kLowest[lattice.u], kHighest[lattice.u]})
          for (int v : {kLowest[lattice.v], kHighest[lattice.v]}) {
            const int i = u - layer.step[k].shift_u, j = v - layer.step[k].shift_v;
            EXPECT_TRUE(i >= lattice.first_u && i < lattice.first_u + lattice.rows);
            EXPECT_TRUE(j >= lattice.first_v && j < lattice.first_v + lattice.pitch);
            EXPECT_LT(lattice.place(i, j), lattice.rays());
          }
  });
}

// In a volume of V voxels the rays are together V / cross section long: what they see is the volume, once.
TEST(RayLattice, LengthTimesCrossSectionIsAVoxel) {
  forLattices([](const RayLattice& lattice, const Vec3d& stretch) {
    EXPECT_NEAR(lattice.length * lattice.cross_section, stretch[0] * stretch[1] * stretch[2], 1e-6);
    EXPECT_GE(lattice.length * (1 + 1e-6), stretch[lattice.w]);
  });
}

}  // namespace
}  // namespace vdb_diffuse
