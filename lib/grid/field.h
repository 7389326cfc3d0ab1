#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "grid/aligned.h"
#include "grid/parallel.h"
#include "grid/topology.h"

namespace vdb_diffuse {

/// One value for every voxel of a topology's blocks, active or not: `blockCount * 512` values in one array.
/// Every kernel may rely on inactive voxels holding the value that the field's owner says (mostly zero).
template <typename T>
class Field {
 public:
  Field() = default;
  explicit Field(const Topology& topology, T value = T()) : Field(topology.blockCount(), value) {}
  explicit Field(size_t block_count, T value = T())
      : blocks_(block_count), values_(alignedArray<T>(block_count * kBlockVoxels)) {
    fill(value);
  }
  Field(const Field& other) : blocks_(other.blocks_), values_(alignedArray<T>(other.size())) {
    forEachBlock(blocks_, [&](size_t b) { std::copy_n(other.block(b), kBlockVoxels, block(b)); });
  }
  Field(Field&&) noexcept = default;
  Field& operator=(Field other) noexcept {
    blocks_ = other.blocks_;
    values_ = std::move(other.values_);
    return *this;
  }

  bool empty() const { return blocks_ == 0; }
  size_t blockCount() const { return blocks_; }
  size_t size() const { return blocks_ * kBlockVoxels; }
  T* block(size_t b) { return values_.get() + b * kBlockVoxels; }
  const T* block(size_t b) const { return values_.get() + b * kBlockVoxels; }
  T* data() { return values_.get(); }
  const T* data() const { return values_.get(); }
  T& operator[](size_t i) { return values_[i]; }
  const T& operator[](size_t i) const { return values_[i]; }

  void fill(T value) {
    forEachBlock(blocks_, [&](size_t b) { std::fill_n(block(b), kBlockVoxels, value); });
  }
  /// Value at a voxel of the topology, or `background` outside its blocks.
  T at(const Topology& topology, const Coord& p_index, T background = T()) const {
    const int32_t b = topology.find(blockOriginOf(p_index));
    if (b == kNoBlock) return background;
    return block(b)[voxelOffset(p_index[0] & 7, p_index[1] & 7, p_index[2] & 7)];
  }

 private:
  size_t blocks_ = 0;
  AlignedArray<T> values_;
};

using VectorField = std::array<Field<float>, 3>;
/// One field for grey light, three for red, green, blue.
using Channels = std::vector<Field<float>>;

}  // namespace vdb_diffuse
