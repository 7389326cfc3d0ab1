#include "io/vdb_dilate.h"

#include <array>

namespace vdb_diffuse {
namespace {

constexpr int kHalo = kBlockWidth + 2;  // a block with one voxel around it

/// The 27 blocks about (and with) the one at `origin`, in a topology that need not have that one.
std::array<int32_t, 27> surrounding(const Topology& topology, const Coord& origin) {
  std::array<int32_t, 27> blocks;
  for (int n = 0; n < 27; ++n)
    blocks[n] = topology.find(
        origin.offsetBy(kBlockWidth * (n / 9 - 1), kBlockWidth * (n / 3 % 3 - 1), kBlockWidth * (n % 3 - 1)));
  return blocks;
}

/// visit(place in the halo, block, voxel) for every active voxel of the halo about a block.
template <typename Visit>
void forEachInHalo(const Topology& topology, const Coord& origin, const Visit& visit) {
  const std::array<int32_t, 27> blocks = surrounding(topology, origin);
  for (int x = 0; x < kHalo; ++x)
    for (int y = 0; y < kHalo; ++y)
      for (int z = 0; z < kHalo; ++z) {
        // 0 -> the block before, 1..8 -> this one, 9 -> the block after
        const int32_t block = blocks[((x + 7) / 8) * 9 + ((y + 7) / 8) * 3 + (z + 7) / 8];
        const int voxel = voxelOffset((x + 7) & 7, (y + 7) & 7, (z + 7) & 7);
        if (block != kNoBlock && topology.active(block).isOn(voxel))
          visit((x * kHalo + y) * kHalo + z, static_cast<size_t>(block), voxel);
      }
}

/// Sum over the 3^3 places about each of the inner 8^3.
template <typename T>
void sumNeighbours(const std::array<T, kHalo * kHalo * kHalo>& halo, std::array<T, kBlockVoxels>& sums) {
  for (int n = 0; n < kBlockVoxels; ++n) {
    const Coord p = voxelLocal(n);
    T sum = 0;
    for (int x = 0; x < 3; ++x)
      for (int y = 0; y < 3; ++y)
        for (int z = 0; z < 3; ++z) sum += halo[((p[0] + x) * kHalo + p[1] + y) * kHalo + p[2] + z];
    sums[n] = sum;
  }
}

}  // namespace

Topology dilatedTopology(const Topology& topology) {
  std::vector<Coord> origins;
  origins.reserve(27 * topology.blockCount());
  for (size_t b = 0; b < topology.blockCount(); ++b)
    for (int n = 0; n < 27; ++n)
      origins.push_back(topology.origin(b).offsetBy(kBlockWidth * (n / 9 - 1), kBlockWidth * (n / 3 % 3 - 1),
                                                    kBlockWidth * (n % 3 - 1)));
  std::sort(origins.begin(), origins.end());
  origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
  std::vector<BlockMask> active(origins.size());
  forEachBlock(origins.size(), [&](size_t b) {
    std::array<int, kHalo * kHalo * kHalo> on{};
    std::array<int, kBlockVoxels> count;
    forEachInHalo(topology, origins[b], [&](int place, size_t, int) { on[place] = 1; });
    sumNeighbours(on, count);
    for (int n = 0; n < kBlockVoxels; ++n)
      if (count[n] > 0) active[b].setOn(n);
  });
  return Topology(std::move(origins), std::move(active));
}

Field<float> dilatedField(const Topology& topology, const Field<float>& values, const Topology& dilated) {
  Field<float> result(dilated);
  forEachBlock(dilated.blockCount(), [&](size_t b) {
    std::array<double, kHalo * kHalo * kHalo> value{};
    std::array<int, kHalo * kHalo * kHalo> on{};
    std::array<double, kBlockVoxels> sum;
    std::array<int, kBlockVoxels> count;
    const Coord origin = dilated.origin(b);
    forEachInHalo(topology, origin, [&](int place, size_t block, int voxel) {
      on[place] = 1;
      value[place] = values.block(block)[voxel];
    });
    sumNeighbours(on, count);
    sumNeighbours(value, sum);
    const int32_t old = topology.find(origin);
    for (auto voxel = dilated.active(b).beginOn(); voxel; ++voxel) {
      const int n = voxel.pos();
      if (old != kNoBlock && topology.active(old).isOn(n))
        result.block(b)[n] = values.block(old)[n];
      else
        result.block(b)[n] = static_cast<float>(sum[n] / count[n]);
    }
  });
  return result;
}

}  // namespace vdb_diffuse
