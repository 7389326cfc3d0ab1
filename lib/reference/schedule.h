#pragma once

#include <cstdint>

namespace vdb_diffuse {

/// How many paths each batch has. The first 32 are small, so that a rough answer comes soon; later ones are a
/// 32nd of all that went before, so that merging them takes a bounded part of the time and a stop wastes
/// little; and no batch is so large that its float sums lose digits. A given total is shared out in these
/// proportions.
class Schedule {
 public:
  /// \param voxels   active ones
  /// \param least    paths of a batch at least
  /// \param total    paths of all batches, 0: no end
  Schedule(uint64_t voxels, uint64_t least, uint64_t total);

  /// Paths of the next batch, 0 after the last.
  uint64_t next();

 private:
  uint64_t first_, most_, least_, total_;
  uint64_t batches_ = 0, plain_ = 0, given_ = 0;  // plain: paths if there were no total
  double stretch_ = 1;

  void advance();
};

}  // namespace vdb_diffuse
