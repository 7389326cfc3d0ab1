#pragma once

#include <memory>
#include <vector>

#include "grid/field.h"
#include "medium/directions.h"
#include "medium/ray_lattice.h"

namespace vdb_diffuse {

/// The order in which light that travels in many directions passes the blocks of a sparse grid.
///
/// Blocks on a plane across an octant's diagonal do not see each other in the octant's directions: such a
/// front runs in parallel, and each block takes all directions of the octant while it is in cache. The rays
/// of a direction keep their light in a plane, one float for each ray of its lattice; where there is no
/// block, light goes on unchanged and nothing is done.
class Wavefront {
 public:
  static constexpr int kOctants = 8;
  using Rays = std::vector<AlignedArray<float>>;  ///< a plane for each direction of an octant

  /// \param stretch  voxel size along each axis over the mean voxel size
  /// \param aside  of the rays, see makeRayLattice
  /// \throws InputError where the planes would take more memory than a grid of a billion voxels
  Wavefront(std::shared_ptr<const Topology> topology, const Vec3d& stretch, const DirectionSet& directions,
            double aside = 0);

  const Topology& topology() const { return *topology_; }
  const std::vector<RayLattice>& lattices(int octant) const { return lattices_[octant]; }

  /// body(block, rays) for every block in the order of an octant. Rays start dark; returned as they leave.
  template <typename Body>
  Rays pass(int octant, const Body& body) const {
    Rays rays = darkRays(octant);
    for (const auto& [first, end] : fronts_[octant])
      forEachBlock(
          end - first, [&, first = first](size_t n) { body(order_[octant][first + n], rays); }, 1);
    return rays;
  }

 private:
  std::shared_ptr<const Topology> topology_;
  std::vector<RayLattice> lattices_[kOctants];
  std::vector<uint32_t> order_[kOctants];                    // of blocks
  std::vector<std::pair<size_t, size_t>> fronts_[kOctants];  // ranges of the order

  void orderBlocks(int octant);
  Rays darkRays(int octant) const;
};

}  // namespace vdb_diffuse
