#include "grid/census.h"

#include <cmath>

#include "grid/parallel.h"
#include "grid/tree_values.h"

namespace vdb_diffuse {
namespace {

struct ValueSums {
  double lowest = INFINITY, highest = -INFINITY, sum = 0;
  uint64_t finite = 0, zeros = 0, negatives = 0, nonfinites = 0;

  void add(double value, uint64_t times) {
    if (!std::isfinite(value)) {
      nonfinites += times;
      return;
    }
    lowest = std::min(lowest, value);
    highest = std::max(highest, value);
    sum += value * static_cast<double>(times);
    finite += times;
    zeros += value == 0 ? times : 0;
    negatives += value < 0 ? times : 0;
  }
  ValueSums& operator+=(const ValueSums& o) {
    lowest = std::min(lowest, o.lowest);
    highest = std::max(highest, o.highest);
    sum += o.sum;
    finite += o.finite;
    zeros += o.zeros;
    negatives += o.negatives;
    nonfinites += o.nonfinites;
    return *this;
  }
};

struct ComponentSums {
  ValueSums of[3];
  ComponentSums& operator+=(const ComponentSums& o) {
    for (int c = 0; c < 3; ++c) of[c] += o.of[c];
    return *this;
  }
};

template <typename Tree>
void takeCensus(const Tree& tree, Census& result) {
  using Leaf = typename Tree::LeafNodeType;
  constexpr int kComponents = componentCount<typename Tree::ValueType>();
  std::vector<const Leaf*> leaves;
  tree.getNodes(leaves);
  ComponentSums each = sumOverBlocks<ComponentSums>(leaves.size(), [&](size_t l) {
    ComponentSums s;
    for (auto value = leaves[l]->cbeginValueOn(); value; ++value)
      for (int c = 0; c < kComponents; ++c) s.of[c].add(component(*value, c), 1);
    return s;
  });
  result.tiles_by_width = {0, 0, 0};
  forEachActiveTile(tree, [&](const auto& value, const Coord&, uint64_t width) {
    ++result.tiles_by_width[width <= 8 ? 0 : width <= 128 ? 1 : 2];
    for (int c = 0; c < kComponents; ++c) each.of[c].add(component(value, c), width * width * width);
  });
  ValueSums sums;
  for (int c = 0; c < kComponents; ++c) {
    const ValueSums& s = each.of[c];
    sums += s;
    result.components.push_back(
        {s.finite ? s.lowest : 0, s.finite ? s.highest : 0, component(tree.background(), c)});
  }
  result.has_values = true;
  if (sums.finite > 0) {
    result.lowest_value = sums.lowest;
    result.highest_value = sums.highest;
    result.mean = sums.sum / static_cast<double>(sums.finite);
  }
  result.zeros = sums.zeros;
  result.negatives = sums.negatives;
  result.nonfinites = sums.nonfinites;
}

}  // namespace

Census census(const openvdb::GridBase& grid) {
  const openvdb::TreeBase& tree = grid.constBaseTree();
  Census result;
  result.active_voxels = tree.activeVoxelCount();
  result.active_leaf_voxels = tree.activeLeafVoxelCount();
  result.leaves = tree.leafCount();
  result.active_tiles = tree.activeTileCount();
  openvdb::CoordBBox box;
  if (tree.evalActiveVoxelBoundingBox(box)) {
    result.lowest = box.min();
    result.highest = box.max();
  }
  grid.apply<ValueGrids>([&](const auto& typed) { takeCensus(typed.tree(), result); });
  return result;
}

}  // namespace vdb_diffuse
