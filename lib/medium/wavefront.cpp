#include "medium/wavefront.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

/// Of the planes of one octant together, in rays: 4 GiB.
constexpr double kMostRays = 1 << 30;

std::vector<Wavefront::Bundle> throughTheMiddle(const Topology& topology, const Vec3d& stretch,
                                                const DirectionSet& directions, double aside) {
  std::vector<Wavefront::Bundle> bundles;
  if (topology.blockCount() == 0) return bundles;
  const auto [low, high] = topology.activeBox();
  for (size_t n = 0; n < directions.size(); ++n) {
    const Vec3d& s = directions.s[n];
    const LatticeAxes axes = latticeAxes(s, stretch);
    Vec3d through = 0.5 * (low.asVec3d() + high.asVec3d());
    for (int a : {axes.u, axes.v}) through[a] += std::copysign(aside, s[a]);
    bundles.push_back({s, directions.weight[n], through});
  }
  return bundles;
}

int octantOf(const Vec3d& s) {
  return (s[0] < 0 ? 4 : 0) + (s[1] < 0 ? 2 : 0) + (s[2] < 0 ? 1 : 0);
}

}  // namespace

bool Wavefront::tooWide(const Topology& topology, size_t directions) {
  double area = 0;  // a bound on the rays of a direction
  const Vec3d size = (topology.highest() - topology.lowest()).asVec3d() + Vec3d(1);
  for (int a = 0; a < 3; ++a)
    area = std::max(area, (size[a] + size[(a + 1) % 3]) * (size[a] + size[(a + 2) % 3]));
  return area * static_cast<double>(directions) > kMostRays;
}

Wavefront::Wavefront(std::shared_ptr<const Topology> topology, const Vec3d& stretch,
                     const DirectionSet& directions, double aside)
    : Wavefront(topology, stretch, throughTheMiddle(*topology, stretch, directions, aside)) {}

Wavefront::Wavefront(std::shared_ptr<const Topology> topology, const Vec3d& stretch,
                     const std::vector<Bundle>& bundles)
    : topology_(std::move(topology)) {
  if (topology_->blockCount() == 0) return;
  size_t count[kOctants] = {};
  for (const Bundle& bundle : bundles) ++count[octantOf(bundle.s)];
  if (tooWide(*topology_, *std::max_element(count, count + kOctants)))
    throw InputError(
        "the volume's bounding box is too large to sweep light through it; crop what lies far away");
  for (size_t n = 0; n < bundles.size(); ++n) {
    std::vector<RayLattice>& lattices = lattices_[octantOf(bundles[n].s)];
    lattices.push_back(makeRayLattice(bundles[n].s, bundles[n].weight, stretch, topology_->lowest(),
                                      topology_->highest(), bundles[n].through));
    lattices.back().number = n;
  }
  for (int octant = 0; octant < kOctants; ++octant)
    if (!lattices_[octant].empty()) orderBlocks(octant);
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

Wavefront::Rays Wavefront::makeRays(int octant, float light) const {
  Rays rays;
  for (const RayLattice& lattice : lattices_[octant]) {
    rays.push_back(alignedArray<float>(lattice.rays()));
    std::fill_n(rays.back().get(), lattice.rays(), light);
  }
  return rays;
}

}  // namespace vdb_diffuse
