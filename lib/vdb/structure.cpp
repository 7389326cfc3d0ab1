#include "vdb/structure.h"

#include <algorithm>

#include "vdb/byte_reader.h"
#include "vdb/metadata_check.h"
#include "vdb/tree_check.h"
#include "vdb/value_chunk.h"

namespace vdb_diffuse {
namespace {

/// From a grid's compression flags, where the reader stands, to its end.
void checkGrid(ByteReader& in, bool has_offsets, VdbHeader::Grid& grid) {
  const std::optional<TreeFormat> format = treeFormat(grid.tree_type);
  if (!format)
    in.fail("holds trees of type " + grid.tree_type + ", which cannot be read; write the file without it");
  grid.compression = in.read<uint32_t>();
  if (grid.compression & ~kEveryCompression)
    in.failDamaged("compression flags " + std::to_string(grid.compression));
  const StoredMetadata metadata = checkMetadata(in);
  if (metadata.half != grid.half)
    in.failDamaged(std::string("it says that it is ") + (grid.half ? "" : "not ") +
                   "stored in 16 bits, and its metadata disagree");
  checkTransform(in);
  grid.checked = true;
  if (format->isOfPoints() && !has_offsets)
    in.fail("holds points, which cannot be passed over in a file written as a stream; write it without them");
  if (grid.instance_of.empty()) {
    const TreeCensus census = checkTree(in, *format, grid.half, grid.compression);
    grid.checked = census.checked;
    grid.tree_bytes = census.bytes(*format);
    if (has_offsets && census.checked && census.blocks_position != grid.block_position)
      in.failDamaged("its values do not begin where the file says");
    if (format->isOfPoints()) {
      const uint64_t rest = grid.end_position - std::min(in.position(), grid.end_position);
      const uint64_t passes = format->leaf == TreeFormat::Leaf::kPoints ? sizeof(uint16_t) : 0;
      grid.checked = census.checked && rest == passes;  // all there is to read after a root without children
      in.seek(grid.end_position);
    }
  }
  if (has_offsets && in.position() != grid.end_position)
    in.failDamaged("it does not end where the file says");
}

/// An instance takes its tree from another grid, which must be there, have one, and be of its type.
void checkInstances(ByteReader& in, VdbHeader& header) {
  for (VdbHeader::Grid& grid : header.grids) {
    if (grid.instance_of.empty()) continue;
    in.setSubject("grid " + grid.name);
    const auto parent = std::find_if(header.grids.begin(), header.grids.end(),
                                     [&](const auto& other) { return other.name == grid.instance_of; });
    if (parent == header.grids.end() || !parent->instance_of.empty() || parent->tree_type != grid.tree_type)
      in.failDamaged("it shares the tree of grid " + grid.instance_of + ", which has none of its type");
    grid.checked = parent->checked;
    grid.tree_bytes = parent->tree_bytes;
  }
}

}  // namespace

VdbHeader checkVdb(const std::string& path) {
  ByteReader in(path);
  VdbHeader header = readVdbHeader(
      in, [&](const VdbHeader& so_far, VdbHeader::Grid& grid) { checkGrid(in, so_far.has_offsets, grid); });
  checkInstances(in, header);
  return header;
}

}  // namespace vdb_diffuse
