#pragma once

#include <functional>
#include <numeric>

#include "medium/wavefront.h"

namespace vdb_diffuse {

constexpr int kMostSteps = 3;                          ///< of a ray through a layer
constexpr int kBlockSteps = kMostSteps * kBlockWidth;  ///< numbers of a block's steps, 3 layer + step

/// Part of the way through a block: the steps whose number, 3 layer + step on the way, lies in a range.
struct Stretch {
  int first = 0, end = kBlockSteps;
  bool has(int layer, int step) const {
    const int number = kMostSteps * layer + step;
    return number >= first && number < end;
  }
};

/// Where something stands in the way of a direction's rays. At a cut the light of a ray and that of a slot
/// change places. It is made in the block that its ray passes next, before one of the steps there; one behind
/// all blocks of its ray, after the last block.
struct DirectionCuts {
  struct Cut {
    uint32_t ray;  ///< its place in the direction's plane
    uint32_t slot;
    uint8_t step;  ///< number in the block
  };
  std::vector<Cut> cuts;        ///< by block, and along the rays in each
  std::vector<uint32_t> first;  ///< of each block, then of those behind, then the end; empty: no cuts
};

/// The light in the slots of an octant, by direction and slot, W/m2/sr.
using CutLight = std::vector<std::vector<float>>;

/// What stands in the way of a wavefront's rays: it takes their light and sends other light on.
struct Obstacles {
  const std::vector<DirectionCuts>* cuts;                    ///< by octant and direction
  std::function<CutLight(int octant)> leaving;               ///< what is in the slots before a sweep
  std::function<void(int octant, const CutLight&)> arrived;  ///< and after it
};

/// Passes a block between the cuts of one direction, where the rays' light and that of the cuts change
/// places. \param pass  pass(part, rays)
template <typename Pass>
void passBetween(const DirectionCuts& at, size_t block, float* rays, float* light, const Pass& pass) {
  Stretch part;
  for (uint32_t c = at.first[block]; c < at.first[block + 1]; ++c) {
    part.end = at.cuts[c].step;
    if (part.end > part.first) pass(part, rays);
    part.first = part.end;
    std::swap(rays[at.cuts[c].ray], light[at.cuts[c].slot]);
  }
  part.end = kBlockSteps;
  pass(part, rays);
}

/// wavefront.pass() among obstacles. What they take is added to `taken`, less what they send on.
/// \param passBlocks  passBlocks(block, passDirection), which calls passDirection(direction, pass) for each
template <typename PassBlocks>
Wavefront::Rays passObstructed(const Wavefront& wavefront, int octant, const Obstacles* obstacles,
                               double& taken, const PassBlocks& passBlocks) {
  if (!obstacles)
    return wavefront.pass(octant, [&](size_t b, Wavefront::Rays& rays) {
      passBlocks(b, [&](size_t d, const auto& pass) { pass(Stretch(), rays[d].get()); });
    });
  const std::vector<RayLattice>& lattices = wavefront.lattices(octant);
  const std::vector<DirectionCuts>& cuts = obstacles->cuts[octant];
  CutLight light = obstacles->leaving(octant);
  const auto total = [&] {
    double sum = 0;
    for (size_t d = 0; d < lattices.size(); ++d)
      sum += std::accumulate(light[d].begin(), light[d].end(), 0.0) * lattices[d].weight *
             lattices[d].cross_section;
    return sum;
  };
  const double sent = total();
  Wavefront::Rays rays = wavefront.pass(octant, [&](size_t b, Wavefront::Rays& planes) {
    passBlocks(b, [&](size_t d, const auto& pass) {
      if (cuts[d].first.empty())
        pass(Stretch(), planes[d].get());
      else
        passBetween(cuts[d], b, planes[d].get(), light[d].data(), pass);
    });
  });
  for (size_t d = 0; d < lattices.size(); ++d) {
    if (cuts[d].first.empty()) continue;
    const std::vector<uint32_t>& first = cuts[d].first;
    for (uint32_t c = first[first.size() - 2]; c < first.back(); ++c)
      std::swap(rays[d][cuts[d].cuts[c].ray], light[d][cuts[d].cuts[c].slot]);
  }
  taken += total() - sent;
  obstacles->arrived(octant, light);
  return rays;
}

}  // namespace vdb_diffuse
