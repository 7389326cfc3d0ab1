#include "multigrid/transfer.h"

#include <limits>

#include "multigrid/block_transfer.h"
#include "multigrid/split_cells.h"

namespace vdb_diffuse {
namespace {

/// Blocks stand in Morton order, so the children of a coarse block are consecutive.
std::shared_ptr<const Topology> coarseTopology(const Topology& fine) {
  std::vector<Coord> origins;
  std::vector<BlockMask> masks;
  for (size_t b = 0; b < fine.blockCount(); ++b) {
    const Coord origin = coarseOriginOf(fine.origin(b));
    if (origins.empty() || origins.back() != origin) {
      origins.push_back(origin);
      masks.emplace_back();
    }
    coarsenMask(fine.active(b), octantOf(fine.origin(b)), masks.back());
  }
  return std::make_shared<const Topology>(std::move(origins), std::move(masks));
}

// A cell has all its voxels held together firmly where none of its inner faces conducts less than this part
// of the best conductor about it; others are looked at more closely. On 2 M voxels of raw density 0.15 finds
// nothing more and takes setup twice as long, 0.02 takes 38 iterations instead of 34.
constexpr float kEven = 0.05f;

/// Whether a cell's inner faces conduct about as well as the others: for the four cells of (x..x+1, y..y+1).
VDB_DIFFUSE_INLINE unsigned unevenCells(const BlockFaces& g, int x, int y) {
  constexpr Row kNone = Row{} + std::numeric_limits<float>::infinity();
  const auto least = [](Row a, Row b) VDB_DIFFUSE_INLINED { return a < b ? a : b; };
  const auto most = [](Row a, Row b) VDB_DIFFUSE_INLINED { return a > b ? a : b; };
  const auto conducting = [&](Row g) VDB_DIFFUSE_INLINED { return g > 0 ? g : kNone; };
  Row weakest = kNone, along_z = kNone, best{};
  for (int i = 0; i < 2; ++i) {
    const Row in_x = loadRow(g.x[x + 1][y + i]), in_y = loadRow(g.y[x + i][y + 1]);
    weakest = least(weakest, least(conducting(in_x), conducting(in_y)));
    best = most(best, most(most(in_x, in_y), most(loadRow(g.x[x][y + i]), loadRow(g.x[x + 2][y + i]))));
    best = most(best, most(loadRow(g.y[x + i][y]), loadRow(g.y[x + i][y + 2])));
    for (int j = 0; j < 2; ++j) {
      const Row above = loadRow(g.above[x + i][y + j]);
      along_z = least(along_z, conducting(above));
      best = most(best, most(above, loadRow(g.below[x + i][y + j])));
    }
  }
  constexpr RowMask kNext = {1, 0, 3, 2, 5, 4, 7, 6}, kLower = {0, 0, 2, 2, 4, 4, 6, 6};
  weakest = least(least(weakest, __builtin_shuffle(weakest, kNext)), __builtin_shuffle(along_z, kLower));
  best = most(best, __builtin_shuffle(best, kNext));
  const RowMask uneven = weakest < kEven * best;
  unsigned cells = 0;
  for (int k = 0; k < 4; ++k) cells |= unsigned{uneven[2 * k] != 0} << k;
  return cells;
}

/// Cells of 2 x 2 x 2 voxels whose active ones are not all joined inside it, or by some much less than they
/// are joined to others, a bit each by x*16 + y*4 + z.
VDB_DIFFUSE_INLINE uint64_t looseCells(const BlockMask& active, const BlockFaces& g) {
  uint64_t loose = 0;
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 4; ++y) loose |= uint64_t{unevenCells(g, 2 * x, 2 * y)} << (16 * x + 4 * y);
  for (int c = 0; c < 64; ++c) {
    const int x = 2 * (c >> 4), y = 2 * (c >> 2 & 3), z = 2 * (c & 3);
    // Bit 4 i + 2 j + k is voxel (x + i, y + j, z + k); what leads from one to the next along an axis is kept
    // by the lower of the two.
    unsigned voxels = 0, along_x = 0, along_y = 0, along_z = 0;
    for (int i = 0; i < 2; ++i) {
      const uint64_t slice = active.getWord<uint64_t>(x + i) >> (8 * y + z);
      voxels |= static_cast<unsigned>((slice & 3) | (slice >> 8 & 3) << 2) << 4 * i;
    }
    if ((voxels & (voxels - 1)) == 0) continue;
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j) {
        along_x |= unsigned{g.x[x + 1][y + i][z + j] > 0} << (2 * i + j);
        along_y |= unsigned{g.y[x + i][y + 1][z + j] > 0} << (4 * i + j);
        along_z |= unsigned{g.above[x + i][y + j][z] > 0} << (4 * i + 2 * j);
      }
    unsigned reached = voxels & (~voxels + 1);
    for (unsigned before = 0; reached != before;) {
      before = reached;
      reached |= (reached & along_x) << 4 | (reached >> 4 & along_x);
      reached |= (reached & along_y) << 2 | (reached >> 2 & along_y);
      reached |= (reached & along_z) << 1 | (reached >> 1 & along_z);
    }
    if (reached != voxels) loose |= uint64_t{1} << c;
  }
  return loose;
}

/// Coarse faces and sinks of the octant that one block fills; returns its looseCells.
VDB_DIFFUSE_KERNEL uint64_t coarsenBlock(const Operator& fine, const Transfer& transfer, Operator& coarse,
                                         size_t b) {
  const size_t parent = static_cast<size_t>(transfer.parent[b]);
  BlockFaces g;
  loadFaces(fine, b, g);
  const float* sink = fine.sink.block(b);
  const Coord octant = octantOf(fine.topology->origin(b));
  const Row half = kTwiceAsFar - Row{};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      const int x = 2 * i, y = 2 * j, to = voxelOffset(octant[0] + i, octant[1] + j, octant[2]);
      const auto four = [&](const float(&rows)[8][8][8]) VDB_DIFFUSE_INLINED {
        return (loadRow(rows[x][y]) + loadRow(rows[x][y + 1])) +
               (loadRow(rows[x + 1][y]) + loadRow(rows[x + 1][y + 1]));
      };
      const float* own = sink + voxelOffset(x, y, 0);
      storePairSums((loadRow(own) + loadRow(own + 8)) + (loadRow(own + 64) + loadRow(own + 72)),
                    coarse.sink.block(parent) + to);
      storePairSums(half * (loadRow(g.x[x][y]) + loadRow(g.x[x][y + 1])), coarse.faces[0].block(parent) + to);
      storePairSums(half * (loadRow(g.y[x][y]) + loadRow(g.y[x + 1][y])), coarse.faces[1].block(parent) + to);
      const Row below = half * four(g.below);
      for (int k = 0; k < 4; ++k) coarse.faces[2].block(parent)[to + k] = below[2 * k];
    }
  return looseCells(fine.topology->active(b), g);
}

}  // namespace

Operator coarsen(const Operator& fine, Twins& twins, size_t most_twins, Transfer& transfer,
                 Twins& coarse_twins) {
  const size_t blocks = fine.topology->blockCount();
  Operator coarse;
  coarse.topology = coarseTopology(*fine.topology);
  transfer.parent.resize(blocks);
  forEachBlock(blocks, [&](size_t b) {
    transfer.parent[b] = coarse.topology->find(coarseOriginOf(fine.topology->origin(b)));
  });
  transfer.spill = Field<float>((blocks * kSpill + kBlockVoxels - 1) / kBlockVoxels);
  for (Field<float>& faces : coarse.faces) faces = Field<float>(*coarse.topology);
  coarse.sink = Field<float>(*coarse.topology);
  std::vector<uint64_t> loose(blocks);
  forEachBlock(blocks, [&](size_t b) { loose[b] = coarsenBlock(fine, transfer, coarse, b); });
  splitCells(fine, twins, std::move(loose), most_twins, transfer, coarse, coarse_twins);
  formDiagonal(coarse);
  return coarse;
}

void addLinks(const Twins& twins, Operator& A) {
  for (const Twins::Link& link : twins.links) {
    if (link.to < 0) continue;
    float& inverse = A.inverse_diagonal[link.to];
    inverse = static_cast<float>(1 / ((inverse > 0 ? 1.0 / inverse : 0) + link.g));
    A.sink[link.to] += link.g;
  }
}

}  // namespace vdb_diffuse
