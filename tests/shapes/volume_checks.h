#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "grid/volume.h"

namespace vdb_diffuse {

/// visit(voxel, value) for every active voxel, in order.
template <typename Visit>
void forEachActive(const Volume& volume, const Visit& visit) {
  for (size_t b = 0; b < volume.topology->blockCount(); ++b)
    for (auto it = volume.topology->active(b).beginOn(); it; ++it)
      visit(volume.topology->origin(b) + voxelLocal(it.pos()), volume.values.block(b)[it.pos()]);
}

/// Density times volume, summed.
inline double massOf(const Volume& volume) {
  double sum = 0;
  forEachActive(volume, [&](const Coord&, float value) { sum += value; });
  return sum * volume.transform.voxelVolume();
}

/// What every later stage relies on: values finite and not negative, zero where inactive, blocks all in use.
inline void expectSound(const Volume& volume) {
  const Topology& topology = *volume.topology;
  ASSERT_EQ(volume.values.blockCount(), topology.blockCount());
  size_t active = 0, unsound = 0, stray = 0;
  for (size_t b = 0; b < topology.blockCount(); ++b) {
    EXPECT_EQ(topology.origin(b), blockOriginOf(topology.origin(b)));
    EXPECT_EQ(topology.find(topology.origin(b)), static_cast<int32_t>(b));
    EXPECT_FALSE(topology.active(b).isOff());
    for (int n = 0; n < kBlockVoxels; ++n) {
      const float value = volume.values.block(b)[n];
      active += topology.active(b).isOn(n);
      unsound += !(value >= 0 && std::isfinite(value));
      stray += !topology.active(b).isOn(n) && value != 0;
    }
  }
  EXPECT_EQ(active, topology.activeVoxelCount());
  EXPECT_EQ(unsound, 0u);
  EXPECT_EQ(stray, 0u);
}

/// The same voxels with the same values, to the bit.
inline bool isSame(const Volume& a, const Volume& b) {
  if (a.topology->blockCount() != b.topology->blockCount()) return false;
  for (size_t i = 0; i < a.topology->blockCount(); ++i)
    if (a.topology->origin(i) != b.topology->origin(i) || a.topology->active(i) != b.topology->active(i) ||
        std::memcmp(a.values.block(i), b.values.block(i), kBlockVoxels * sizeof(float)) != 0)
      return false;
  return true;
}

inline void expectSame(const Volume& a, const Volume& b) {
  EXPECT_TRUE(isSame(a, b));
}

}  // namespace vdb_diffuse
