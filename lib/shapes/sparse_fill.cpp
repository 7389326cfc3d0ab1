#include "shapes/sparse_fill.h"

#include <algorithm>
#include <memory>

namespace vdb_diffuse {
namespace {

constexpr int kRegionWidth = 64;  ///< voxels: 8 x 8 x 8 blocks, one task for a thread

/// The blocks that one task found, in the order in which it met them.
struct Region {
  std::vector<Coord> origins;
  std::vector<BlockMask> active;
  std::vector<float> values;  ///< 512 per block
};

Region filledRegion(const Formula& formula, const Coord& lowest) {
  Region region;
  if (!formula.may_touch(lowest, lowest.offsetBy(kRegionWidth - 1))) return region;
  for (int n = 0; n < kBlockVoxels; ++n) {
    const Coord origin = lowest + Coord(voxelLocal(n).x() * kBlockWidth, voxelLocal(n).y() * kBlockWidth,
                                        voxelLocal(n).z() * kBlockWidth);
    if (!formula.may_touch(origin, origin.offsetBy(kBlockWidth - 1))) continue;
    float values[kBlockVoxels] = {};
    BlockMask active;
    formula.fill(origin, values, active);
    if (active.isOff()) continue;
    region.origins.push_back(origin);
    region.active.push_back(active);
    region.values.insert(region.values.end(), values, values + kBlockVoxels);
  }
  region.values.shrink_to_fit();
  return region;
}

}  // namespace

Volume sparseFill(const Formula& formula, double voxel_size, const Vec3d& origin) {
  const Coord low = formula.lowest & ~(kRegionWidth - 1);
  size_t count[3];
  for (int a = 0; a < 3; ++a)
    count[a] = static_cast<size_t>((formula.highest[a] - low[a]) / kRegionWidth + 1);
  std::vector<Region> regions(count[0] * count[1] * count[2]);
  forEachBlock(
      regions.size(),
      [&](size_t r) {
        const int i = static_cast<int>(r / (count[1] * count[2]));
        const int j = static_cast<int>(r / count[2] % count[1]), k = static_cast<int>(r % count[2]);
        regions[r] = filledRegion(formula, low + Coord(i * kRegionWidth, j * kRegionWidth, k * kRegionWidth));
      },
      1);

  std::vector<Coord> origins;
  std::vector<BlockMask> active;
  for (const Region& region : regions) {
    origins.insert(origins.end(), region.origins.begin(), region.origins.end());
    active.insert(active.end(), region.active.begin(), region.active.end());
  }
  Volume volume;
  volume.topology = std::make_shared<const Topology>(std::move(origins), std::move(active));
  volume.transform = Transform::uniform(voxel_size, origin);
  volume.values = Field<float>(*volume.topology);
  forEachBlock(
      regions.size(),
      [&](size_t r) {
        const Region region = std::move(regions[r]);  // freed as soon as it is copied
        for (size_t b = 0; b < region.origins.size(); ++b)
          std::copy_n(&region.values[b * kBlockVoxels], kBlockVoxels,
                      volume.values.block(static_cast<size_t>(volume.topology->find(region.origins[b]))));
      },
      1);
  return volume;
}

}  // namespace vdb_diffuse
