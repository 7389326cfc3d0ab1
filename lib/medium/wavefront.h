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

  /// Parallel rays: their direction, its share of the sphere, and a point, in voxels, that one of them
  /// passes.
  struct Bundle {
    Vec3d s;
    double weight;
    Vec3d through;
  };

  /// \param stretch  voxel size along each axis over the mean voxel size
  /// \throws InputError where tooWide()
  Wavefront(std::shared_ptr<const Topology> topology, const Vec3d& stretch,
            const std::vector<Bundle>& bundles);
  /// Rays through the middle of the active voxels, so that a volume that is moved or mirrored meets the same
  /// rays. \param aside  of it, in voxels, toward where the rays go. 0: the rays of s and -s are the same
  /// lines, so that what a voxel's mean misses by where they run in it cancels in the flux.
  Wavefront(std::shared_ptr<const Topology> topology, const Vec3d& stretch, const DirectionSet& directions,
            double aside = 0);
  /// Would the planes of so many directions in one octant take more memory than a grid of a billion voxels?
  static bool tooWide(const Topology& topology, size_t directions);

  const Topology& topology() const { return *topology_; }
  const std::vector<RayLattice>& lattices(int octant) const { return lattices_[octant]; }

  /// A plane for each direction, its rays all dark or all of this light.
  Rays makeRays(int octant, float light = 0) const;
  /// body(block, rays) for every block in the order of an octant. Returns the rays as they leave.
  template <typename Body>
  Rays pass(int octant, Rays rays, const Body& body) const {
    for (const auto& [first, end] : fronts_[octant])
      forEachBlock(
          end - first, [&, first = first](size_t n) { body(order_[octant][first + n], rays); }, 1);
    return rays;
  }
  /// The same for rays that start dark.
  template <typename Body>
  Rays pass(int octant, const Body& body) const {
    return pass(octant, makeRays(octant), body);
  }

 private:
  std::shared_ptr<const Topology> topology_;
  std::vector<RayLattice> lattices_[kOctants];
  std::vector<uint32_t> order_[kOctants];                    // of blocks
  std::vector<std::pair<size_t, size_t>> fronts_[kOctants];  // ranges of the order

  void orderBlocks(int octant);
};

}  // namespace vdb_diffuse
