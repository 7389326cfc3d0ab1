#include "surfaces/surface_light.h"

#include <algorithm>

namespace vdb_diffuse {

SurfaceLight::SurfaceLight(const Wavefront& wavefront, const SurfaceCuts& cuts,
                           const std::vector<Surface>& surfaces, int channel)
    : wavefront_(wavefront),
      cuts_(cuts),
      received_(cuts.cells.keys.size(), 0.0),
      radiance_(cuts.cells.keys.size(), 0.0f) {
  for (const CellKey& key : cuts.cells.keys)
    albedo_.push_back(static_cast<float>(surfaces[key.surface].albedo[channel]));
}

bool SurfaceLight::reflects() const {
  return std::any_of(albedo_.begin(), albedo_.end(), [](float albedo) { return albedo > 0; });
}

Obstacles SurfaceLight::obstacles() {
  return {cuts_.cuts, [this](int octant) { return leaving(octant); },
          [this](int octant, const CutLight& light) { arrived(octant, light); }};
}

CutLight SurfaceLight::leaving(int octant) const {
  const auto& ends = cuts_.ends[octant];
  CutLight light(ends.size());
  forEachBlock(
      ends.size(),
      [&](size_t d) {
        light[d].reserve(ends[d].leaves.size());
        for (uint32_t cell : ends[d].leaves)
          light[d].push_back(cell == SurfaceCuts::kNoCell ? 0.0f : radiance_[cell]);
      },
      1);
  return light;
}

void SurfaceLight::arrived(int octant, const CutLight& light) {
  const std::vector<RayLattice>& lattices = wavefront_.lattices(octant);
  for (size_t d = 0; d < light.size(); ++d) {
    const double share = lattices[d].weight * lattices[d].cross_section;
    const std::vector<uint32_t>& cells = cuts_.ends[octant][d].arrives;
    for (size_t c = 0; c < cells.size(); ++c)
      if (cells[c] != SurfaceCuts::kNoCell) received_[cells[c]] += share * light[d][c];
  }
}

void SurfaceLight::turn() {
  const SurfaceCells& cells = cuts_.cells;
  for (size_t n = 0; n < radiance_.size(); ++n) {
    double around = 0;
    for (uint32_t c = cells.first[n]; c < cells.first[n + 1]; ++c) around += received_[cells.around[c]];
    radiance_[n] = static_cast<float>(4 * albedo_[n] * around / cells.area[n]);
  }
  std::fill(received_.begin(), received_.end(), 0.0);
}

}  // namespace vdb_diffuse
