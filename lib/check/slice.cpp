#include "check/slice.h"

#include <algorithm>

namespace vdb_diffuse {
namespace {

void stretch(const Topology& topology, Coord& lowest, Coord& highest) {
  for (size_t b = 0; b < topology.blockCount(); ++b)
    for (auto voxel = topology.active(b).beginOn(); voxel; ++voxel) {
      const Coord p = topology.origin(b) + voxelLocal(voxel.pos());
      lowest.minComponent(p);
      highest.maxComponent(p);
    }
}

}  // namespace

SlicePlane sliceThrough(const Coord& at, const Topology& a, const Topology& b) {
  SlicePlane plane;
  plane.lowest = plane.highest = at;
  for (const Topology* topology : {&a, &b}) stretch(*topology, plane.lowest, plane.highest);
  const Coord extent = plane.highest - plane.lowest;
  for (int axis = 0; axis < 3; ++axis)
    if (extent[axis] < extent[plane.normal]) plane.normal = axis;
  plane.right = plane.normal == 0 ? 1 : 0;
  plane.up = plane.normal == 2 ? 1 : 2;
  plane.lowest[plane.normal] = plane.highest[plane.normal] = at[plane.normal];
  return plane;
}

std::vector<float> sliceValues(const GridValues& grid, int component, const SlicePlane& plane) {
  const size_t c = std::min(static_cast<size_t>(component), grid.channels.size() - 1);
  std::vector<float> values;
  values.reserve(static_cast<size_t>(plane.width()) * plane.height());
  Coord p = plane.lowest;
  for (p[plane.up] = plane.highest[plane.up]; p[plane.up] >= plane.lowest[plane.up]; --p[plane.up])
    for (p[plane.right] = plane.lowest[plane.right]; p[plane.right] <= plane.highest[plane.right];
         ++p[plane.right]) {
      const bool active = grid.topology->isActive(p);
      values.push_back(active ? grid.channels[c].at(*grid.topology, p) : grid.background[c]);
    }
  return values;
}

}  // namespace vdb_diffuse
