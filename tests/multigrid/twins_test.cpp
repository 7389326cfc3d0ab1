#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "multigrid/solve.h"
#include "multigrid/transfer.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

/// Unit conductances between active voxels, the same sink in each.
Operator networkOf(const Medium& medium, float sink) {
  Operator A;
  A.topology = medium.density.topology;
  A.half_resistance = Field<float>(*A.topology, std::numeric_limits<float>::infinity());
  A.sink = Field<float>(*A.topology);
  forEachVoxel(*A.topology, [&](Coord, size_t i) {
    A.half_resistance[i] = 0.5f;
    A.sink[i] = sink;
  });
  formDiagonal(A);
  return A;
}

Operator networkOf(const std::vector<Coord>& voxels, float sink) {
  return networkOf(boxMedium(Coord(8), Transform(),
                             [&](Coord p) {
                               return std::find(voxels.begin(), voxels.end(), p) != voxels.end() ? 1.0 : -1.0;
                             }),
                   sink);
}

/// The level below a finest one.
struct Coarsened {
  Twins none, twins;
  Transfer transfer;
  Operator coarse;
  explicit Coarsened(const Operator& A, size_t most_twins = 1000)
      : coarse(coarsen(A, none, most_twins, transfer, twins)) {}
};

TEST(Twins, PairsThatMeetAtAnEdgeAreApart) {
  for (int axis = 0; axis < 3; ++axis)
    for (const int turn : {-1, 1}) {
      Coord along(0), aside(0);
      along[axis] = 1;
      aside[(axis + 1) % 3] = 1;
      aside[(axis + 2) % 3] = turn;
      Coord p(2);
      if (turn < 0) p[(axis + 2) % 3] = 3;
      const Coord q = p + aside;  // in the same coarse voxel
      const Operator A = networkOf({p, p + along, q, q + along}, 0.25f);
      const Coarsened level(A);
      ASSERT_EQ(level.twins.size(), 1u) << axis << ' ' << turn;
      EXPECT_TRUE(level.twins.links.empty());
      EXPECT_EQ(level.twins.place[0], Coord(1));
      EXPECT_EQ(level.twins.sink[0], 0.5f);
      EXPECT_EQ(level.coarse.sink[voxelOffset(1, 1, 1)], 0.5f);
    }
}

/// Two rods along z, side by side at an edge, joined at their upper ends.
TEST(Twins, TwoRodsAreAChainEach) {
  std::vector<Coord> voxels{Coord(2, 3, 7)};
  for (int z = 0; z < 8; ++z) {
    voxels.emplace_back(2, 2, z);
    voxels.emplace_back(3, 3, z);
  }
  const Operator A = networkOf(voxels, 1.0f);
  const Coarsened level(A);
  ASSERT_EQ(level.twins.size(), 3u);  // none where the rods meet
  const auto joint = [&](size_t t, Node to) {
    float g = 0;
    for (int32_t k = level.twins.first[t]; k < level.twins.first[t + 1]; ++k)
      if (level.twins.links[k].to == to) g += level.twins.links[k].g;
    return g;
  };
  for (size_t t = 0; t < 3; ++t) {
    EXPECT_EQ(level.twins.place[t], Coord(1, 1, static_cast<int>(t)));
    EXPECT_EQ(level.twins.sink[t], 2.0f);
    EXPECT_EQ(level.coarse.sink[voxelOffset(1, 1, static_cast<int>(t))], 2.0f);
  }
  EXPECT_EQ(level.coarse.sink[voxelOffset(1, 1, 3)], 5.0f);
  EXPECT_EQ(level.twins.links.size(), 5u);
  EXPECT_EQ(joint(0, ~Node{1}), kTwiceAsFar);
  EXPECT_EQ(joint(1, ~Node{0}), kTwiceAsFar);
  EXPECT_EQ(joint(1, ~Node{2}), kTwiceAsFar);
  EXPECT_EQ(joint(2, voxelOffset(1, 1, 3)), kTwiceAsFar);
  for (int z = 1; z < 4; ++z) EXPECT_EQ(level.coarse.faces[2][voxelOffset(1, 1, z)], kTwiceAsFar) << z;
}

/// Conductances of voxels in series, each with the half resistance that `of` gives; none where it is
/// negative.
template <typename HalfResistance>
Operator unevenNetwork(const HalfResistance& of) {
  const Medium medium = boxMedium(Coord(8), Transform(), [&](Coord p) { return of(p) >= 0 ? 1.0 : -1.0; });
  Operator A = networkOf(medium, 0.0f);
  forEachVoxel(*A.topology, [&](Coord p, size_t i) { A.half_resistance[i] = static_cast<float>(of(p)); });
  formDiagonal(A);
  return A;
}

/// Two good conductors lead into a coarse voxel, and a bad one of the same coarse voxel joins them.
TEST(Twins, ConductorsWithABadOneBetweenThemAreApart) {
  for (const bool bad : {true, false}) {
    const Operator A = unevenNetwork([&](Coord p) {
      if (p == Coord(3, 2, 2)) return bad ? 1.0 : 0.001;
      const bool good = (p[1] == 2 && p[2] == 2 && p[0] <= 2) || (p[1] == 3 && p[2] == 2 && p[0] >= 3);
      return good ? 0.001 : -1.0;
    });
    const Coarsened level(A);
    ASSERT_EQ(level.twins.size(), bad ? 1u : 0u);
    if (!bad) continue;
    EXPECT_EQ(level.twins.place[0], Coord(1));
    ASSERT_EQ(level.twins.links.size(),
              2u);  // to the coarse voxel beside it, and past the bad one to its own
    for (const Twins::Link& link : level.twins.links)
      EXPECT_FLOAT_EQ(link.g, link.to == voxelOffset(1, 1, 1) ? 1 / 1.001f : kTwiceAsFar / 0.002f);
    EXPECT_FLOAT_EQ(level.coarse.faces[0][voxelOffset(1, 1, 1)] + level.coarse.faces[0][voxelOffset(2, 1, 1)],
                    kTwiceAsFar / 0.002f);  // one of the two is the twin's
  }
}

/// Two pairs of good conductors among bad ones: each moves as a whole, and the smoother hardly sees by how
/// much.
TEST(Twins, PairsAmongBadConductorsAreApart) {
  for (const double of_pairs : {0.5, 0.001}) {
    const Operator A = unevenNetwork([&](Coord p) {
      const bool paired = p[0] / 2 == 1 && p[0] == p[1] && p[2] / 2 == 1;
      return paired ? of_pairs : 0.5;
    });
    const Coarsened level(A);
    EXPECT_EQ(level.twins.size(), of_pairs < 0.5 ? 1u : 0u);
  }
}

/// An even correction stays even wherever rows are mended, and nothing is counted against itself.
TEST(Twins, MendedRowsKeepWhatIsEven) {
  const Medium medium = boxMedium(Coord(24), Transform(), [](Coord p) { return lumpyDensity(p); });
  const Operator A = networkOf(medium, 1e-3f);
  const Coarsened level(A);
  ASSERT_GT(level.twins.size(), 10u);
  for (size_t row = 0; row < level.transfer.apart.rows(); ++row) {
    float own = 0, blocks = 0;
    for (int32_t k = level.transfer.apart.first[row]; k < level.transfer.apart.first[row + 1]; ++k) {
      own += level.transfer.apart.weights[k].own;
      blocks += level.transfer.apart.weights[k].blocks;
      EXPECT_GE(level.transfer.apart.weights[k].own, 0);
    }
    const bool alone = own == 0;  // joined to nothing
    EXPECT_NEAR(own, alone ? 0 : 1, 1e-6);
    EXPECT_NEAR(blocks, 1, 1e-6);
  }
}

TEST(Twins, NoiseHasNone) {
  const Medium medium = boxMedium(Coord(24), Transform(), [](Coord p) { return lumpyDensity(p); });
  const Operator A = networkOf(medium, 1e-3f);
  const Coarsened level(A, 10);
  EXPECT_EQ(level.twins.size(), 0u);
  EXPECT_EQ(level.transfer.apart.rows(), 0u);
}

/// Two slabs, a gap of one voxel between them and a bridge of one voxel over it: light that is even in each
/// but not the same is what a coarse grid ties together that does not see the gap. Where coarse voxels had no
/// twins, it took up to 33 iterations, by where the gap fell among them.
TEST(Twins, AGapMayFallAnywhere) {
  std::string counts;
  for (int offset = 0; offset < 16; ++offset) {
    const Medium medium = boxMedium(
        Coord(40, 41, 40), Transform(),
        [](Coord p) { return p[1] != 20 || (p[0] == 0 && p[2] == 0) ? 1.0 : -1.0; }, Coord(0, offset, 0));
    const auto A = std::make_shared<const Operator>(networkOf(medium, 1e-5f));
    CycleSettings cycle;
    cycle.direct_unknowns = 20;
    Multigrid multigrid(A, cycle);
    Field<float> b(*A->topology);
    forEachVoxel(*A->topology, [&](Coord p, size_t i) { b[i] = p[1] < 20 + offset ? 1.0f : 0.0f; });
    Field<double> x(*A->topology);
    const SolveReport report = solve(multigrid, b, x, {1e-6, 0, 100, {}});
    EXPECT_TRUE(report.converged);
    EXPECT_LE(report.iterations, 24) << offset;
    counts += " " + std::to_string(report.iterations);
  }
  RecordProperty("iterations", counts);
}

}  // namespace
}  // namespace vdb_diffuse
