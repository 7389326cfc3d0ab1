#include "multigrid/smoother.h"

#include "multigrid/block_kernel.h"

namespace vdb_diffuse {
namespace {

// The voxels with x + y + z odd, in rows that start with an even and with an odd voxel.
constexpr RowMask kColour[2] = {{0, -1, 0, -1, 0, -1, 0, -1}, {-1, 0, -1, 0, -1, 0, -1, 0}};

VDB_DIFFUSE_KERNEL void smoothBlock(const Operator& A, const Field<float>& b, Field<float>& x, size_t block,
                                    SweepOrder order, int sweeps, bool start_zero, bool halo_zero) {
  const float *inverse = A.inverse_diagonal.block(block), *rhs = b.block(block);
  const uint8_t* rows = rowBits(A.topology->active(block));
  prefetchBlock(rhs);
  prefetchBlock(inverse);
  if (!start_zero) prefetchBlock(x.block(block));
  BlockFaces g;
  Halo<float> u;
  loadFaces(A, block, g);
  if (halo_zero)
    clear(u);
  else
    loadHalo(*A.topology, x, block, 0.0f, u);
  if (start_zero && !halo_zero)
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j) storeRow(u.row(i, j), Row{});
  for (int pass = 0; pass < 2 * sweeps; ++pass) {
    const int colour = (pass & 1) ^ (order == SweepOrder::kBackward ? 1 : 0);
    // Rows in a checkerboard too: no row waits for the store of the one before it, which is its neighbour.
    for (int half = 0; half < 2; ++half)
      for (int i = 0; i < 8; ++i)
        for (int j = (i + half) & 1; j < 8; j += 2) {
          if (!rows[i * 8 + j]) continue;
          const int n = voxelOffset(i, j, 0);
          float* own = u.row(i, j);
          const Row relaxed = (loadRow(rhs + n) + rowOfNeighbours(g, u, i, j)) * loadRow(inverse + n);
          storeRow(own, kColour[half ^ colour] ? relaxed : loadRow(own));
        }
  }
  float* out = x.block(block);
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j) storeRow(out + voxelOffset(i, j, 0), loadRow(u.row(i, j)));
}

}  // namespace

Smoother::Smoother(const Topology& topology) {
  for (size_t b = 0; b < topology.blockCount(); ++b) {
    const Coord& o = topology.origin(b);
    blocks_[((o[0] ^ o[1] ^ o[2]) >> 3) & 1].push_back(static_cast<int32_t>(b));
  }
}

void Smoother::smooth(const Operator& A, const Field<float>& b, Field<float>& x, SweepOrder order, int sweeps,
                      bool from_zero) const {
  for (int half = 0; half < 2; ++half) {
    const std::vector<int32_t>& blocks = blocks_[order == SweepOrder::kForward ? half : 1 - half];
    forEachBlock(blocks.size(), [&](size_t i) {
      smoothBlock(A, b, x, static_cast<size_t>(blocks[i]), order, sweeps, from_zero, from_zero && half == 0);
    });
  }
}

}  // namespace vdb_diffuse
