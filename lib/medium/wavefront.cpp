#include "medium/wavefront.h"

#include <algorithm>
#include <numeric>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

/// Of the planes of one octant together, in rays: 4 GiB.
constexpr double kMostRays = 1 << 30;

/// Middle of the active voxels' bounding box, in voxels.
Vec3d middleOf(const Topology& topology) {
  Coord low = Coord::max(), high = Coord::min();
  for (size_t b = 0; b < topology.blockCount(); ++b)
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const Coord p = topology.origin(b) + voxelLocal(static_cast<int>(it.pos()));
      low.minComponent(p);
      high.maxComponent(p);
    }
  return 0.5 * (low.asVec3d() + high.asVec3d());
}

/// A bound on the rays of all directions of an octant.
double raysOf(const Topology& topology, size_t directions) {
  double area = 0;
  const Vec3d size = (topology.highest() - topology.lowest()).asVec3d() + Vec3d(1);
  for (int a = 0; a < 3; ++a)
    area = std::max(area, (size[a] + size[(a + 1) % 3]) * (size[a] + size[(a + 2) % 3]));
  return area * static_cast<double>(directions) / Wavefront::kOctants;
}

}  // namespace

Wavefront::Wavefront(std::shared_ptr<const Topology> topology, const Vec3d& stretch,
                     const DirectionSet& directions, double aside)
    : topology_(std::move(topology)) {
  if (topology_->blockCount() == 0) return;
  if (raysOf(*topology_, directions.size()) > kMostRays)
    throw InputError(
        "the volume's bounding box is too large to sweep light through it; crop what lies far away");
  const Vec3d middle = middleOf(*topology_);
  for (size_t n = 0; n < directions.size(); ++n) {
    const Vec3d& s = directions.s[n];
    const int octant = (s[0] < 0 ? 4 : 0) + (s[1] < 0 ? 2 : 0) + (s[2] < 0 ? 1 : 0);
    lattices_[octant].push_back(makeRayLattice(s, directions.weight[n], stretch, topology_->lowest(),
                                               topology_->highest(), middle, aside));
  }
  for (int octant = 0; octant < kOctants; ++octant) orderBlocks(octant);
}

void Wavefront::orderBlocks(int octant) {
  const size_t count = topology_->blockCount();
  std::vector<int64_t> diagonal(count);
  for (size_t b = 0; b < count; ++b) {
    const Coord& p = topology_->origin(b);
    diagonal[b] = int64_t{octant & 4 ? -1 : 1} * p[0] + int64_t{octant & 2 ? -1 : 1} * p[1] +
                  int64_t{octant & 1 ? -1 : 1} * p[2];
  }
  std::vector<uint32_t>& order = order_[octant];
  order.resize(count);
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return diagonal[a] < diagonal[b]; });
  for (size_t first = 0; first < count;) {
    size_t end = first + 1;
    while (end < count && diagonal[order[end]] == diagonal[order[first]]) ++end;
    fronts_[octant].emplace_back(first, end);
    first = end;
  }
}

Wavefront::Rays Wavefront::darkRays(int octant) const {
  Rays rays;
  for (const RayLattice& lattice : lattices_[octant]) {
    rays.push_back(alignedArray<float>(lattice.rays()));
    std::fill_n(rays.back().get(), lattice.rays(), 0.0f);
  }
  return rays;
}

}  // namespace vdb_diffuse
