#pragma once

#include "medium/angular_basis.h"
#include "medium/sweep.h"
#include "volumes.h"

namespace vdb_diffuse {

inline Vec3d stretchOf(const Medium& medium) {
  return medium.transform().voxelSize() / medium.transform().meanVoxelSize();
}

inline Wavefront wavefrontOf(const Medium& medium, int directions = 96) {
  return Wavefront(medium.density.topology, stretchOf(medium), halfRangeSet(directions));
}

/// The source J(p), everything else zero; tau is the medium's density times `extinction` times the mean voxel
/// size.
template <typename Function>
SweepSource sourceOf(const Medium& medium, double extinction, const Function& J, int moments = 0) {
  const Topology& topology = medium.topology();
  SweepSource source{Field<float>(topology),
                     Field<float>(topology),
                     {Field<float>(topology), Field<float>(topology), Field<float>(topology)},
                     std::vector<Field<float>>(moments, Field<float>(topology))};
  forEachVoxel(topology, [&](Coord p, size_t i) {
    source.tau[i] =
        static_cast<float>(extinction * medium.transform().meanVoxelSize() * medium.density.values[i]);
    source.J[i] = static_cast<float>(J(p));
  });
  return source;
}

/// A source that differs in every way from voxel to voxel, and is never negative.
inline SweepSource unevenSource(const Medium& medium, double extinction, int moments) {
  SweepSource source = sourceOf(
      medium, extinction, [](Coord p) { return 1 + hashed(p, 11); }, moments);
  forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
    for (int a = 0; a < 3; ++a) source.slope[a][i] = static_cast<float>(0.6 * (hashed(p, 20 + a) - 0.5));
    for (int k = 0; k < moments; ++k)
      source.angular[k][i] = static_cast<float>(0.1 * (hashed(p, 30 + k) - 0.5));
  });
  return source;
}

inline double sumOver(const Topology& topology, const Field<float>& field) {
  double sum = 0;
  forEachVoxel(topology, [&](Coord, size_t i) { sum += field[i]; });
  return sum;
}

}  // namespace vdb_diffuse
