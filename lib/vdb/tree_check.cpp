#include "vdb/tree_check.h"

#include <algorithm>
#include <array>
#include <map>

#include "vdb/value_chunk.h"

namespace vdb_diffuse {
namespace {

using Corner = std::array<int32_t, 3>;
using LeafMask = std::array<uint64_t, 8>;
using Leaf = TreeFormat::Leaf;

constexpr uint32_t kLeafSlots = 8 * 8 * 8, kLowerSlots = 16 * 16 * 16, kUpperSlots = 32 * 32 * 32;
constexpr int32_t kLeafWidth = 8, kLowerWidth = 128, kUpperWidth = 4096;

/// How a node's values are stored.
enum ValueKind : int8_t { kOneOther = 2, kSelected, kSelectedOneOther, kSelectedTwoOthers, kAllValues };

std::string at(const Corner& corner) {
  return "(" + std::to_string(corner[0]) + "," + std::to_string(corner[1]) + "," + std::to_string(corner[2]) +
         ")";
}

uint32_t countOn(const uint64_t* words, uint32_t slots) {
  uint32_t count = 0;
  for (uint32_t w = 0; w < slots / 64; ++w) count += static_cast<uint32_t>(__builtin_popcountll(words[w]));
  return count;
}

class TreeWalk {
 public:
  TreeWalk(ByteReader& in, const TreeFormat& format, bool half, uint32_t compression)
      : in_(in),
        format_(format),
        half_(half && format.half_bytes > 0),
        compression_(compression),
        chunks_(in, compression) {}

  TreeCensus walk() {
    passRoot();
    census_.blocks_position = in_.position();
    for (size_t l = 0; l < masks_.size(); ++l)
      passBuffer(masks_[l], corners_.empty() ? Corner{} : corners_[l]);
    census_.leaves = masks_.size();
    return census_;
  }

 private:
  ByteReader& in_;
  const TreeFormat format_;
  const bool half_;
  const uint32_t compression_;
  ValueChunks chunks_;
  TreeCensus census_;
  std::vector<LeafMask> masks_;  // of the leaves, in the order of their buffers
  std::vector<Corner> corners_;  // and where they lie, for those that store it again

  void passRoot() {
    const int32_t buffers = in_.read<int32_t>();
    if (buffers != 1) in_.failDamaged("a tree of " + std::to_string(buffers) + " buffers");
    in_.skip(format_.value_bytes);  // background
    const uint32_t tiles = in_.read<uint32_t>(), children = in_.read<uint32_t>();
    census_.root_tiles = tiles;
    std::vector<Corner> taken;
    for (uint32_t t = 0; t < tiles; ++t) {
      taken.push_back(readRootCorner());
      in_.skip(format_.value_bytes);
      in_.readBool();
    }
    std::sort(taken.begin(), taken.end());
    const auto twice = std::adjacent_find(taken.begin(), taken.end());
    if (twice != taken.end()) in_.failDamaged("two tiles at " + at(*twice));
    census_.checked = children == 0 || !format_.isOfPoints();
    if (!census_.checked) return;
    Corner last{};
    for (uint32_t c = 0; c < children; ++c) {
      const Corner corner = readRootCorner();
      if (c > 0 && !(last < corner)) in_.failDamaged("a node at " + at(corner) + " after one at " + at(last));
      if (std::binary_search(taken.begin(), taken.end(), corner))
        in_.failDamaged("a node and a tile at " + at(corner));
      last = corner;
      passNode<kUpperSlots, kUpperWidth>(corner);
    }
  }

  Corner readRootCorner() {
    Corner corner;
    for (int32_t& x : corner) {
      x = in_.read<int32_t>();
      if (x % kUpperWidth != 0)
        in_.failDamaged("a corner of the root at " + std::to_string(x) + ", no multiple of 4096");
    }
    return corner;
  }

  template <uint32_t kSlots, int32_t kWidth>
  void passNode(const Corner& corner) {
    ++(kSlots == kUpperSlots ? census_.upper_nodes : census_.lower_nodes);
    std::array<uint64_t, kSlots / 64> child, active;
    std::memcpy(child.data(), in_.take(sizeof child), sizeof child);
    std::memcpy(active.data(), in_.take(sizeof active), sizeof active);
    for (uint32_t w = 0; w < kSlots / 64; ++w)
      if (child[w] & active[w]) in_.failDamaged("a place that is a node and an active tile at once");
    passValues(kSlots, countOn(active.data(), kSlots));
    constexpr int32_t kAcross = kSlots == kUpperSlots ? 32 : 16, kChildWidth = kWidth / kAcross;
    for (uint32_t slot = 0; slot < kSlots; ++slot) {
      if (!(child[slot / 64] >> slot % 64 & 1)) continue;
      const int32_t n = static_cast<int32_t>(slot);
      const Corner place{corner[0] + kChildWidth * (n / (kAcross * kAcross)),
                         corner[1] + kChildWidth * (n / kAcross % kAcross),
                         corner[2] + kChildWidth * (n % kAcross)};
      if constexpr (kSlots == kUpperSlots)
        passNode<kLowerSlots, kLowerWidth>(place);
      else
        passLeafMask(place);
    }
  }

  void passLeafMask(const Corner& corner) {
    LeafMask mask;
    std::memcpy(mask.data(), in_.take(sizeof mask), sizeof mask);
    masks_.push_back(mask);
    if (format_.leaf == Leaf::kBools || format_.leaf == Leaf::kMask) corners_.push_back(corner);
  }

  void passBuffer(const LeafMask& mask, const Corner& corner) {
    if (std::memcmp(in_.take(sizeof mask), mask.data(), sizeof mask) != 0)
      in_.failDamaged("a leaf that is not active where the tree says");
    if (format_.leaf == Leaf::kValues) {
      passValues(kLeafSlots, countOn(mask.data(), kLeafSlots));
      return;
    }
    if (std::memcmp(in_.take(sizeof corner), corner.data(), sizeof corner) != 0)
      in_.failDamaged("a leaf at " + at(corner) + " that says it lies elsewhere");
    if (format_.leaf == Leaf::kBools) in_.skip(sizeof mask);
  }

  void passValues(uint32_t slots, uint32_t active) {
    const int8_t kind = in_.read<int8_t>();
    if (kind < 0 || kind > kAllValues) in_.failDamaged("values of unknown kind " + std::to_string(kind));
    if (kind == kOneOther || kind == kSelectedOneOther || kind == kSelectedTwoOthers)
      in_.skip(uint64_t(format_.value_bytes) * (kind == kSelectedTwoOthers ? 2 : 1));
    if (kind == kSelected || kind == kSelectedOneOther || kind == kSelectedTwoOthers) in_.skip(slots / 8);
    const uint32_t count = (compression_ & kActiveValues) && kind != kAllValues ? active : slots;
    if (half_ && count == 0) return;  // not even a chunk of no bytes
    chunks_.pass(uint64_t(count) * (half_ ? format_.half_bytes : format_.value_bytes));
  }
};

}  // namespace

std::optional<TreeFormat> treeFormat(const std::string& type) {
  static const std::map<std::string, TreeFormat> formats = {
      {"float", {4, 2, Leaf::kValues}},      {"double", {8, 2, Leaf::kValues}},
      {"vec3s", {12, 6, Leaf::kValues}},     {"vec3d", {24, 6, Leaf::kValues}},
      {"int32", {4, 0, Leaf::kValues}},      {"int64", {8, 0, Leaf::kValues}},
      {"vec3i", {12, 0, Leaf::kValues}},     {"bool", {1, 0, Leaf::kBools}},
      {"mask", {1, 0, Leaf::kMask}},         {"ptidx32", {4, 0, Leaf::kPointIndices}},
      {"ptdataidx32", {4, 0, Leaf::kPoints}}};
  const std::string start = "Tree_", end = "_5_4_3";
  if (type.size() <= start.size() + end.size() || type.compare(0, start.size(), start) != 0 ||
      type.compare(type.size() - end.size(), end.size(), end) != 0)
    return std::nullopt;
  const auto known = formats.find(type.substr(start.size(), type.size() - start.size() - end.size()));
  if (known == formats.end()) return std::nullopt;
  return known->second;
}

uint64_t TreeCensus::bytes(const TreeFormat& format) const {
  constexpr uint64_t kPointer = 8, kOverhead = 128;  // of what holds a node; counted generously
  const uint64_t slot = (format.value_bytes + kPointer - 1) / kPointer * kPointer;  // holds either
  const uint64_t leaf = format.leaf == Leaf::kValues ? kLeafSlots * format.value_bytes : kLeafSlots / 8;
  return leaves * (leaf + kLeafSlots / 8 + kOverhead) +
         lower_nodes * (kLowerSlots * slot + 2 * kLowerSlots / 8 + kOverhead) +
         upper_nodes * (kUpperSlots * slot + 2 * kUpperSlots / 8 + kOverhead) + root_tiles * kOverhead;
}

TreeCensus checkTree(ByteReader& in, const TreeFormat& format, bool half, uint32_t compression) {
  return TreeWalk(in, format, half, compression).walk();
}

}  // namespace vdb_diffuse
