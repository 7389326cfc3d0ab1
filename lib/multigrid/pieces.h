#pragma once

#include <vector>

#include "multigrid/operator.h"

namespace vdb_diffuse {

/// Parts of a block that belong to pieces which do not touch. Most blocks are one part.
struct Part {
  int32_t block;
  int32_t layer;  ///< parts of different layers never share a coarse voxel
  int32_t mask;   ///< index into Parts::masks; -1: the whole block
};

struct Parts {
  std::vector<Part> parts;  ///< sorted by block
  std::vector<BlockMask> masks;
  std::vector<int32_t> first;  ///< of each block among `parts`, and one past the last
  int32_t layers = 1;
};

/// Every block as one part in one layer.
Parts wholeBlocks(const Topology& topology);

/// Splits blocks by the connected pieces of the operator (voxels joined by faces that conduct). Wisps beside
/// a cloud, and lobes beside each other, must not share a coarse voxel: it would tie together what is not,
/// and a piece's own constant, which the smoother hardly sees, could not be corrected. The largest piece
/// takes layer 0, any other the first layer where at no level of coarsening it meets a piece that is there;
/// single voxels are solved by the smoother and stay in layer 0, and so do pieces for which no memory is
/// meant.
Parts separatePieces(const Operator& A);

}  // namespace vdb_diffuse
