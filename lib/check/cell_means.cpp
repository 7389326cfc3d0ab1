#include "check/cell_means.h"

#include <map>

namespace vdb_diffuse {
namespace {

struct Sum {
  int count = 0;
  std::array<double, 3> values{0, 0, 0};
};

int floorDiv(int a, int b) {
  return a >= 0 ? a / b : -((b - 1 - a) / b);
}

Transform coarseTransform(const Transform& fine, int width) {
  const double middle = 0.5 * (width - 1);  // of the cell (0,0,0), in voxels
  return Transform(fine.axis(0) * width, fine.axis(1) * width, fine.axis(2) * width,
                   fine.toWorld(Vec3d(middle)));
}

}  // namespace

GridValues cellMeans(const GridValues& grid, int width) {
  const Topology& fine = *grid.topology;
  std::map<Coord, Sum> cells;
  for (size_t b = 0; b < fine.blockCount(); ++b)
    for (auto voxel = fine.active(b).beginOn(); voxel; ++voxel) {
      const Coord p = fine.origin(b) + voxelLocal(voxel.pos());
      Sum& sum = cells[Coord(floorDiv(p[0], width), floorDiv(p[1], width), floorDiv(p[2], width))];
      ++sum.count;
      for (size_t c = 0; c < grid.channels.size(); ++c)
        sum.values[c] += grid.channels[c].block(b)[voxel.pos()];
    }

  std::map<Coord, BlockMask> masks;
  for (const auto& [p, sum] : cells) masks[blockOriginOf(p)].setOn(voxelOffset(p[0] & 7, p[1] & 7, p[2] & 7));
  std::vector<Coord> origins;
  std::vector<BlockMask> active;
  for (const auto& [origin, mask] : masks) {
    origins.push_back(origin);
    active.push_back(mask);
  }
  GridValues means;
  means.topology = std::make_shared<Topology>(std::move(origins), std::move(active));
  means.transform = coarseTransform(grid.transform, width);
  means.background = grid.background;
  for (size_t c = 0; c < grid.channels.size(); ++c) {
    means.channels.emplace_back(*means.topology);
    for (const auto& [p, sum] : cells) {
      const int32_t b = means.topology->find(blockOriginOf(p));
      means.channels[c].block(b)[voxelOffset(p[0] & 7, p[1] & 7, p[2] & 7)] =
          static_cast<float>(sum.values[c] / sum.count);
    }
  }
  return means;
}

}  // namespace vdb_diffuse
