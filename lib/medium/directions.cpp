#include "medium/directions.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace vdb_diffuse {
namespace {

/// First cosine, and the weights of the kinds of point, by the sorted levels (i, j, k) that a point stands
/// on.
struct Table {
  int order;
  double first_cosine;
  std::vector<std::pair<std::array<int, 3>, double>> weights;
};

const Table& tableOf(int order) {
  static const std::vector<Table> kTables{
      {4, 0.3500212, {{{1, 1, 2}, 1.0 / 3}}},
      {6, 0.2666355, {{{1, 1, 3}, 0.1761263}, {{1, 2, 2}, 0.1572071}}},
      {8, 0.2182179, {{{1, 1, 4}, 0.1209877}, {{1, 2, 3}, 0.0907407}, {{2, 2, 2}, 0.0925926}}},
      {12,
       0.1672126,
       {{{1, 1, 6}, 0.0707626},
        {{1, 2, 5}, 0.0558811},
        {{1, 3, 4}, 0.0373377},
        {{2, 2, 4}, 0.0502819},
        {{2, 3, 3}, 0.0258513}}},
      {16,
       0.1389568,
       {{{1, 1, 8}, 0.0489872},
        {{1, 2, 7}, 0.0413296},
        {{1, 3, 6}, 0.0212326},
        {{1, 4, 5}, 0.0256207},
        {{2, 2, 6}, 0.0360486},
        {{2, 3, 5}, 0.0144589},
        {{2, 4, 4}, 0.0344958},
        {{3, 3, 4}, 0.0085179}}}};
  const auto found =
      std::find_if(kTables.begin(), kTables.end(), [&](const Table& t) { return t.order == order; });
  assert(found != kTables.end());
  return *found;
}

}  // namespace

DirectionSet levelSymmetric(int order) {
  const Table& table = tableOf(order);
  const int levels = order / 2;
  std::vector<double> cosine(levels + 1);
  const double first = table.first_cosine * table.first_cosine, step = 2 * (1 - 3 * first) / (order - 2);
  for (int i = 1; i <= levels; ++i) cosine[i] = std::sqrt(first + (i - 1) * step);

  DirectionSet set;
  double sum = 0;
  for (int octant = 0; octant < 8; ++octant)
    for (int i = 1; i <= levels; ++i)
      for (int j = 1; i + j <= levels + 1; ++j) {
        const int k = levels + 2 - i - j;
        std::array<int, 3> kind{i, j, k};
        std::sort(kind.begin(), kind.end());
        const openvdb::Vec3d s(cosine[i], cosine[j], cosine[k]);
        set.s.push_back(
            openvdb::Vec3d(octant & 4 ? -s[0] : s[0], octant & 2 ? -s[1] : s[1], octant & 1 ? -s[2] : s[2])
                .unit());
        for (const auto& [levels_of_kind, weight] : table.weights)
          if (levels_of_kind == kind) set.weight.push_back(weight);
        sum += set.weight.back();
      }
  assert(set.weight.size() == set.s.size());
  for (double& weight : set.weight) weight /= sum;  // the table's seven digits
  return set;
}

DirectionSet offPlanes() {
  // The fourth moments are those of the sphere: with x^2 + y^2 + z^2 = 1, x^4 + y^4 + z^4 = 3/5.
  const double x = 0.25, sum = 1 - x * x, fourths = 0.6 - x * x * x * x;
  const double root = std::sqrt(2 * fourths - sum * sum);
  std::array<double, 3> cosine{x, std::sqrt(0.5 * (sum - root)), std::sqrt(0.5 * (sum + root))};
  DirectionSet set;
  for (int octant = 0; octant < 8; ++octant) {
    std::sort(cosine.begin(), cosine.end());
    do {
      set.s.emplace_back(octant & 4 ? -cosine[0] : cosine[0], octant & 2 ? -cosine[1] : cosine[1],
                         octant & 1 ? -cosine[2] : cosine[2]);
      set.weight.push_back(1.0 / 48);
    } while (std::next_permutation(cosine.begin(), cosine.end()));
  }
  return set;
}

}  // namespace vdb_diffuse
