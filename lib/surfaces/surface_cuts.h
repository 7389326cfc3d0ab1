#pragma once

#include "medium/ray_cuts.h"
#include "scene/occluder.h"
#include "surfaces/surface_cells.h"

namespace vdb_diffuse {

/// Where a scene's surfaces cut the rays of a wavefront, and which of their cells each cut belongs to. The
/// same for all sweeps and channels.
///
/// A voxel lies on that side of a surface where its centre lies, as it does for the walls of the diffusion
/// equation: rays are cut between two of their steps, so that light passes through a plate nowhere, be it
/// much thinner than a voxel. A ray that slants through a surface may meet voxels of either side by turns;
/// the light of either side then waits in the slot of the meeting while the other's passes. Of the surfaces
/// before a ray's first block only the last one counts, and of those behind its last block only the first.
struct SurfaceCuts {
  static constexpr uint32_t kNoCell = ~0u;
  /// Cells by slot: the one that the light arrives at and the one that sends it on. None for a black surface,
  /// for what reaches a surface before the first block, and for what leaves one behind the last.
  struct Ends {
    std::vector<uint32_t> arrives, leaves;
  };
  std::vector<DirectionCuts> cuts[Wavefront::kOctants];  ///< by direction
  std::vector<Ends> ends[Wavefront::kOctants];
  SurfaceCells cells;
  bool empty() const { return cuts[0].empty(); }  ///< no surfaces
};

/// Empty where there are no surfaces.
SurfaceCuts findSurfaceCuts(const Wavefront& wavefront, const Transform& transform, const Occluder& occluder,
                            const std::vector<Surface>& surfaces);

}  // namespace vdb_diffuse
