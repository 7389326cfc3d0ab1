#pragma once

#include <openvdb/openvdb.h>

#include <cstdint>
#include <string>
#include <type_traits>

// What those few files share that look into OpenVDB's trees: each costs seconds to compile. Not for headers.

namespace vdb_diffuse {

using ValueGrids =
    openvdb::TypeList<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::Vec3SGrid, openvdb::Vec3DGrid>;

template <typename T>
constexpr int componentCount() {
  return std::is_floating_point_v<T> ? 1 : 3;
}
template <typename T>
double component(const T& value, [[maybe_unused]] int c) {
  if constexpr (std::is_floating_point_v<T>)
    return value;
  else
    return value[c];
}

/// visit(value, corner, width) for every active tile, a cube of `width` voxels.
template <typename Tree, typename Visit>
void forEachActiveTile(const Tree& tree, const Visit& visit) {
  auto tile = tree.cbeginValueOn();
  tile.setMaxDepth(Tree::ValueOnCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    openvdb::CoordBBox box;
    tile.getBoundingBox(box);
    visit(*tile, box.min(), static_cast<uint64_t>(int64_t(box.max()[0]) - box.min()[0] + 1));
  }
}

}  // namespace vdb_diffuse
