#include "blobs/cells.h"

#include <algorithm>

namespace vdb_diffuse {
namespace {

/// Numbers the cells of this width and returns how many there are.
size_t number(const Topology& topology, Cells& cells) {
  const int side = kBlockWidth / cells.width;
  const size_t blocks = topology.blockCount();
  cells.at.assign(blocks * cells.perBlock(), -1);
  cells.first.assign(blocks + 1, 0);
  int32_t count = 0;
  for (size_t b = 0; b < blocks; ++b) {
    cells.first[b] = count;
    int32_t* at = cells.at.data() + b * cells.perBlock();
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const Coord p = voxelLocal(static_cast<int>(it.pos()));
      at[((p[0] / cells.width) * side + p[1] / cells.width) * side + p[2] / cells.width] = 0;
    }
    for (int i = 0; i < cells.perBlock(); ++i)
      if (at[i] == 0) at[i] = count++;
  }
  cells.first[blocks] = count;
  return count;
}

}  // namespace

Cells findCells(const Medium& medium, size_t least) {
  const Topology& topology = medium.topology();
  Cells cells;
  if (topology.blockCount() == 0) {
    cells.first = {0};
    return cells;
  }
  const size_t all = topology.activeVoxelCount();
  cells.width = all >= 512 * least ? 8 : all >= 64 * least ? 4 : all >= 8 * least ? 2 : 1;
  const size_t count = number(topology, cells);
  cells.origin = topology.lowest();
  for (int a = 0; a < 3; ++a)
    cells.stretch[a] = medium.transform().voxelSize()[a] / medium.transform().meanVoxelSize();
  for (size_t b = 0; b < topology.blockCount(); ++b) cells.corner.push_back(cells.frame(topology.origin(b)));
  cells.centre.assign(count, Vec3d(0));
  cells.volume.assign(count, 0);
  cells.mass.assign(count, 0);
  forEachBlock(topology.blockCount(), [&](size_t b) {
    const float* rho = medium.density.values.block(b);
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      const int32_t c = cells.of(b, n);
      cells.centre[c] += cells.frame(topology.origin(b) + voxelLocal(n));
      cells.volume[c] += 1;
      cells.mass[c] += rho[n];
    }
    for (size_t c = cells.first[b]; c < cells.first[b + 1]; ++c) cells.centre[c] /= cells.volume[c];
  });
  return cells;
}

}  // namespace vdb_diffuse
