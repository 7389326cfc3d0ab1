#pragma once

#include <optional>
#include <string>

#include "vdb/byte_reader.h"

namespace vdb_diffuse {

/// How a tree of one type stores its values.
struct TreeFormat {
  enum class Leaf { kValues, kBools, kMask, kPoints, kPointIndices };
  uint32_t value_bytes = 0;  ///< of a value alone, and in memory
  uint32_t half_bytes = 0;   ///< of a value among many where the grid is stored in 16 bits
  Leaf leaf = Leaf::kValues;

  bool isOfPoints() const { return leaf == Leaf::kPoints || leaf == Leaf::kPointIndices; }
};

/// For instance of Tree_float_5_4_3; none for a type that this OpenVDB cannot make either.
std::optional<TreeFormat> treeFormat(const std::string& type);

struct TreeCensus {
  bool checked = true;  ///< false for points, of which only the root is looked into
  uint64_t leaves = 0, lower_nodes = 0, upper_nodes = 0, root_tiles = 0;
  uint64_t blocks_position = 0;  ///< in the file: where the topology ends and the values of the leaves begin

  /// What the tree takes in memory.
  uint64_t bytes(const TreeFormat& format) const;
};

/// Steps over a tree as OpenVDB would read it:
///
///     topology   1 buffer, background, root tiles (corner, value, active), root children (corner, upper
///     node)
///                upper node   masks of 32^3 children and active tiles, values of tiles, lower nodes
///                lower node   masks of 16^3 children and active tiles, values of tiles, leaf masks
///     buffers    for each leaf its mask again, and values
///
/// The values of a node begin with a byte that tells how inactive ones are stored: as one or two values and a
/// mask that chooses between them, and then only the active ones follow; or all of them.
///
/// Of points only the root is stepped over. OpenVDB looks at none of: root corners that are not multiples of
/// 4096, or come twice, or children out of order (it reads their leaves in order); a place that is both a
/// child and an active tile (it takes the pointer for a value); leaf masks that disagree; anything past the
/// file's end.
TreeCensus checkTree(ByteReader& in, const TreeFormat& format, bool half, uint32_t compression);

}  // namespace vdb_diffuse
