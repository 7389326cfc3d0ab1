#include "medium/coarse_medium.h"

#include <algorithm>

#include "grid/coarse_block.h"

namespace vdb_diffuse {
namespace {

int parentVoxel(const Coord& octant, int n) {
  const Coord p = voxelLocal(n);
  return voxelOffset(octant[0] + (p[0] >> 1), octant[1] + (p[1] >> 1), octant[2] + (p[2] >> 1));
}

/// Blocks whose parent is one; they stand together, as blocks are in Morton order.
struct Family {
  size_t begin, end;
};

std::vector<Family> familiesOf(const Topology& fine) {
  std::vector<Family> families;
  for (size_t b = 0; b < fine.blockCount(); ++b)
    if (b == 0 || coarseOriginOf(fine.origin(b)) != coarseOriginOf(fine.origin(b - 1)))
      families.push_back({b, b + 1});
    else
      families.back().end = b + 1;
  return families;
}

std::shared_ptr<const Topology> coarseTopology(const Topology& fine, const std::vector<Family>& families) {
  std::vector<Coord> origins(families.size());
  std::vector<BlockMask> active(families.size());
  forEachBlock(families.size(), [&](size_t f) {
    origins[f] = coarseOriginOf(fine.origin(families[f].begin));
    for (size_t b = families[f].begin; b < families[f].end; ++b)
      coarsenMask(fine.active(b), octantOf(fine.origin(b)), active[f]);
  });
  return std::make_shared<const Topology>(std::move(origins), std::move(active));
}

/// An eighth of the sum of term(block, voxel) over each voxel's children.
template <typename Term>
Field<float> meanOverChildren(const Topology& fine, const std::vector<Family>& families,
                              const Topology& coarse, const Term& term) {
  Field<float> means(coarse);
  forEachBlock(families.size(), [&](size_t f) {
    double sums[kBlockVoxels] = {};
    for (size_t b = families[f].begin; b < families[f].end; ++b) {
      const Coord octant = octantOf(fine.origin(b));
      for (auto voxel = fine.active(b).beginOn(); voxel; ++voxel)
        sums[parentVoxel(octant, static_cast<int>(voxel.pos()))] += term(b, static_cast<int>(voxel.pos()));
    }
    float* out = means.block(coarse.find(coarseOriginOf(fine.origin(families[f].begin))));
    for (int n = 0; n < kBlockVoxels; ++n) out[n] = static_cast<float>(sums[n] / 8);
  });
  return means;
}

}  // namespace

Medium coarsened(const Medium& medium) {
  const Topology& fine = medium.topology();
  const std::vector<Family> families = familiesOf(fine);
  const Field<float>& rho = medium.density.values;
  Medium coarse;
  coarse.optics = medium.optics;
  coarse.density.name = medium.density.name;
  coarse.density.topology = coarseTopology(fine, families);
  const Transform& t = medium.transform();
  coarse.density.transform =
      Transform(t.axis(0) * 2.0, t.axis(1) * 2.0, t.axis(2) * 2.0, t.toWorld(Vec3d(0.5)));
  coarse.density.values =
      meanOverChildren(fine, families, coarse.topology(), [&](size_t b, int n) { return rho.block(b)[n]; });
  const auto weightedMean = [&](const Field<float>& values, const auto& weight) {
    const auto term = [&](size_t b, int n) { return static_cast<double>(weight(b, n)); };
    const Field<float> weights = meanOverChildren(fine, families, coarse.topology(), term);
    Field<float> mean = meanOverChildren(fine, families, coarse.topology(),
                                         [&](size_t b, int n) { return term(b, n) * values.block(b)[n]; });
    for (size_t i = 0; i < mean.size(); ++i) mean[i] = weights[i] > 0 ? mean[i] / weights[i] : 0;
    return mean;
  };
  const auto density = [&](size_t b, int n) { return rho.block(b)[n]; };
  for (const Field<float>& channel : medium.albedo) coarse.albedo.push_back(weightedMean(channel, density));
  if (medium.albedo.empty()) {
    for (const Field<float>& channel : medium.emission)
      coarse.emission.push_back(weightedMean(channel, density));
    return coarse;
  }
  for (int c = 0; c < (medium.grey() ? 1 : 3) && !medium.emission.empty(); ++c)
    coarse.emission.push_back(weightedMean(medium.emissionIn(c), [&](size_t b, int n) {
      return medium.absorptionIn(c, b * kBlockVoxels + n) * rho.block(b)[n];
    }));
  return coarse;
}

}  // namespace vdb_diffuse
