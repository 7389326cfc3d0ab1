#pragma once

#include "multigrid/operator.h"

namespace vdb_diffuse {

enum class SweepOrder { kForward, kBackward };

/// Gauss-Seidel in two colours of blocks (a checkerboard of 8^3 blocks, whose faces touch only the other
/// colour), and within a block in two colours of voxels, `sweeps` times while the block is in cache. Backward
/// runs all of it in reverse and is the adjoint of forward in the energy of A, so that a cycle with one
/// before and the other after is a symmetric preconditioner. Results do not depend on the number of threads.
///
/// With `from_zero`, x need not be initialised and is taken as zero.
struct Smoother {
  explicit Smoother(const Topology& topology);
  void smooth(const Operator& A, const Field<float>& b, Field<float>& x, SweepOrder order, int sweeps,
              bool from_zero) const;

 private:
  std::vector<int32_t> blocks_[2];  // by colour
};

}  // namespace vdb_diffuse
