#pragma once

#include <atomic>
#include <memory>

#include "grid/field.h"

namespace vdb_diffuse {

/// Visits all blocks several times in one pass over memory. Blocks have the two colours of a checkerboard, so
/// that a block's neighbours are of the other colour; stages 0, 2, .. visit blocks of colour 0 and stages 1,
/// 3, .. those of colour 1, each block as soon as the stage before is done in all its neighbours:
///
///      stage 0   o       o       o      .          along a row of blocks; o has been visited,
///      stage 1       o       o      .              . is next. What a visit reads was written a
///      stage 2   o       o      .                  few blocks ago and is in cache still.
///
/// So the stages follow each other through the volume like waves. The order of visits to neighbours is always
/// the same, hence results do not depend on the number of threads.
class Wave {
 public:
  explicit Wave(const Topology& topology)
      : topology_(&topology), arrived_(new std::atomic<uint8_t>[topology.blockCount()]) {
    for (size_t b = 0; b < topology.blockCount(); ++b) {
      const Coord& o = topology.origin(b);
      const int colour = ((o[0] ^ o[1] ^ o[2]) >> 3) & 1;
      if (colour == 0)
        first_.push_back(static_cast<int32_t>(b));
      else if (neighbourCount(b) == 0)
        alone_.push_back(static_cast<int32_t>(b));
    }
  }

  /// visit(stage, block), in parallel. A visit may write to its block and read all that earlier stages have
  /// written to neighbours.
  template <typename Visit>
  void run(int stages, const Visit& visit) {
    forEachBlock(
        topology_->blockCount(), [&](size_t b) { arrived_[b].store(0, std::memory_order_relaxed); }, 4096);
    forEachBlock(first_.size(), [&](size_t i) { start(first_[i], 0, stages, visit); });
    forEachBlock(alone_.size(), [&](size_t i) { start(alone_[i], 1, stages, visit); });
  }

 private:
  const Topology* topology_;
  std::vector<int32_t> first_, alone_;  // blocks of colour 0, and those of colour 1 that nothing leads to
  std::unique_ptr<std::atomic<uint8_t>[]> arrived_;  // how often a neighbour has finished a stage

  int neighbourCount(size_t b) const {
    int count = 0;
    for (const int32_t near : topology_->neighbours(b)) count += near != kNoBlock;
    return count;
  }

  template <typename Visit>
  void start(int32_t b, int stage, int stages, const Visit& visit) {
    if (neighbourCount(static_cast<size_t>(b)) > 0) return go(b, stage, stages, visit);
    for (; stage < stages; stage += 2) visit(stage, static_cast<size_t>(b));
  }

  template <typename Visit>
  void go(int32_t b, int stage, int stages, const Visit& visit) {
    visit(stage, static_cast<size_t>(b));
    if (++stage == stages) return;
    for (const int32_t near : topology_->neighbours(static_cast<size_t>(b))) {
      if (near == kNoBlock) continue;
      const int arrived = arrived_[near].fetch_add(1, std::memory_order_acq_rel) + 1;
      if (arrived % neighbourCount(static_cast<size_t>(near)) == 0) go(near, stage, stages, visit);
    }
  }
};

}  // namespace vdb_diffuse
