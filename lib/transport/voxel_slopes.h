#pragma once

#include "diffusion/diffuse.h"

namespace vdb_diffuse {

/// How steep the diffuse light of a channel is in each voxel, from sweep to sweep: the straight line with the
/// first moment of I0, per voxel along the grid's axes.
///
/// In thin voxels that is the slope which the diffusion equation gives the same I0 (diffusiveFlux). It misses
/// what light does within a mean free path of a surface, and from one or two optical depths per voxel on all
/// of that happens inside one voxel: thicker ones take the first moment that the sweep itself has found. That
/// one has the diffusion limit (the linear characteristic scheme; Larsen and Morel 1989), but sees few rays
/// in a voxel, and thin ones need it less.
class VoxelSlopes {
 public:
  VoxelSlopes(const ChannelSolution& channel, const Medium& medium);

  /// Is there a voxel that takes the slope of a sweep?
  bool needsSwept() const { return !own_[0].empty(); }
  /// For the light as it stands. \param slope  holds it, unless it is kept here
  const VectorField& now(const ChannelSolution& channel, const Medium& medium, VectorField& slope) const;
  /// After a sweep. \param swept  its slopes  \param correction  those of the correction that followed
  void update(const ChannelSolution& channel, const Medium& medium, const VectorField& swept,
              const VectorField& correction);

 private:
  VectorField own_;           // of the sweeps; empty where every voxel is thin
  bool of_equation_ = false;  // own_ is all the equation's: no sweep yet
};

}  // namespace vdb_diffuse
