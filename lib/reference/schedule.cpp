#include "reference/schedule.h"

#include <algorithm>
#include <cmath>

namespace vdb_diffuse {

constexpr uint64_t kFirstBatches = 32;

// A path visits some hundred voxels, so a batch of as many paths as there are voxels adds some hundred terms
// to each sum, and rarely more than a million to the brightest.
Schedule::Schedule(uint64_t voxels, uint64_t least, uint64_t total)
    : first_(std::clamp<uint64_t>(voxels / 64, 256, 1 << 14)),
      most_(std::clamp<uint64_t>(voxels, 1 << 12, 1 << 18)),
      least_(std::max<uint64_t>(least, 1)),
      total_(total) {
  if (total == 0) return;
  Schedule plain = *this;
  while (plain.batches_ < kFirstBatches || plain.plain_ < total) plain.advance();
  stretch_ = static_cast<double>(total) / static_cast<double>(plain.plain_);
}

void Schedule::advance() {
  plain_ += batches_ < kFirstBatches ? first_ : std::clamp(plain_ / kFirstBatches, first_, most_);
  ++batches_;
}

uint64_t Schedule::next() {
  if (total_ > 0 && given_ >= total_) return 0;
  const uint64_t before = given_;
  while (given_ < before + least_) {
    advance();
    given_ = static_cast<uint64_t>(std::llround(static_cast<double>(plain_) * stretch_));
  }
  return given_ - before;
}

}  // namespace vdb_diffuse
