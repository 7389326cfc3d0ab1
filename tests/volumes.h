#pragma once

#include <cmath>
#include <functional>

#include "medium/medium.h"
#include "scene/scene.h"

namespace vdb_diffuse {

/// A medium whose density is rho(i,j,k) over the box 0 <= (i,j,k) < size, moved by `offset`; voxels where rho
/// returns a negative number are not active.
inline Medium boxMedium(const Coord& size, const Transform& transform,
                        const std::function<double(Coord)>& rho, const Coord& offset = Coord(0, 0, 0)) {
  std::vector<Coord> origins;
  std::vector<BlockMask> masks;
  const Coord low = blockOriginOf(offset), high = offset + size;
  for (int x = low[0]; x < high[0]; x += 8)
    for (int y = low[1]; y < high[1]; y += 8)
      for (int z = low[2]; z < high[2]; z += 8) {
        BlockMask mask;
        for (int n = 0; n < kBlockVoxels; ++n) {
          const Coord p = Coord(x, y, z) + voxelLocal(n) - offset;
          if (p[0] >= 0 && p[1] >= 0 && p[2] >= 0 && p[0] < size[0] && p[1] < size[1] && p[2] < size[2] &&
              rho(p) >= 0)
            mask.setOn(n);
        }
        origins.emplace_back(x, y, z);
        masks.push_back(mask);
      }
  Medium medium;
  medium.density.topology = std::make_shared<const Topology>(origins, masks);
  medium.density.transform = transform;
  const Topology& topology = medium.topology();
  medium.density.values = Field<float>(topology);
  for (size_t b = 0; b < topology.blockCount(); ++b)
    for (auto it = topology.active(b).beginOn(); it; ++it)
      medium.density.values.block(b)[it.pos()] =
          static_cast<float>(rho(topology.origin(b) + voxelLocal(static_cast<int>(it.pos())) - offset));
  return medium;
}

/// A ball of density 1 and radius R (world) whose centre is a voxel corner, voxels of side h.
inline Medium ballMedium(double R, double h) {
  const int n = 2 * (static_cast<int>(R / h) + 2);
  return boxMedium(Coord(n), Transform::uniform(h), [=](Coord p) {
    const Vec3d d = (p.asVec3d() - Vec3d(0.5 * (n - 1))) * h;
    return d.length() < R ? 1.0 : -1.0;
  });
}

/// Largest |a - b| over active voxels, as a fraction of the largest |b|.
inline double largestDifference(const Topology& topology, const Field<float>& a, const Field<float>& b) {
  double difference = 0, largest = 0;
  for (size_t block = 0; block < topology.blockCount(); ++block)
    for (auto it = topology.active(block).beginOn(); it; ++it) {
      const double u = a.block(block)[it.pos()], v = b.block(block)[it.pos()];
      difference = std::max(difference, std::abs(u - v));
      largest = std::max(largest, std::abs(v));
    }
  return largest > 0 ? difference / largest : difference;
}

/// body(p, i) for every active voxel: its coordinates and its index in a field.
template <typename Body>
void forEachVoxel(const Topology& topology, const Body& body) {
  for (size_t b = 0; b < topology.blockCount(); ++b)
    for (auto it = topology.active(b).beginOn(); it; ++it)
      body(topology.origin(b) + voxelLocal(static_cast<int>(it.pos())), b * kBlockVoxels + it.pos());
}

/// Largest |a(p) - b(map(p))| over the active voxels p of a, as a fraction of the largest |b|; infinity where
/// map(p) is not active or the counts differ.
inline double largestDifference(const Topology& topology_a, const Field<float>& a, const Topology& topology_b,
                                const Field<float>& b, const std::function<Coord(Coord)>& map) {
  if (topology_a.activeVoxelCount() != topology_b.activeVoxelCount()) return HUGE_VAL;
  double difference = 0, largest = 0;
  forEachVoxel(topology_a, [&](Coord p, size_t i) {
    const Coord q = map(p);
    const double v = topology_b.isActive(q) ? b.at(topology_b, q) : HUGE_VAL;
    difference = std::max(difference, std::abs(a[i] - v));
    largest = std::max(largest, std::abs(v));
  });
  return largest > 0 ? difference / largest : difference;
}

/// A number in 0..1 hashed from the coordinates and a seed.
inline double hashed(const Coord& p, uint64_t seed = 0) {
  uint64_t h = seed + 1;
  for (int a = 0; a < 3; ++a) {
    h = (h ^ static_cast<uint32_t>(p[a])) * 0x9E3779B97F4A7C15ull;
    h = (h ^ (h >> 29)) * 0xBF58476D1CE4E5B9ull;
    h ^= h >> 32;
  }
  return static_cast<double>(h >> 11) * 0x1p-53;
}

/// A lumpy piece of cloud that is no symmetric shape: active where a hash of 3-voxel lumps says so, about
/// three voxels of four, with densities from 0.1 to 1.1.
inline double lumpyDensity(const Coord& p, uint64_t seed = 0) {
  const Coord lump(p[0] / 3, p[1] / 3, p[2] / 3);
  return hashed(lump, seed) < 0.25 ? -1 : 0.1 + hashed(p, seed + 7);
}

/// An emission of radiance Q(i,j,k) on a medium's voxels.
inline void setEmission(Medium& medium, const std::function<double(Coord)>& Q) {
  medium.emission.assign(1, Field<float>(medium.topology()));
  forEachVoxel(medium.topology(),
               [&](Coord p, size_t i) { medium.emission[0][i] = static_cast<float>(Q(p)); });
}

/// An albedo field a(i,j,k) on a medium's voxels, of one channel or, told apart by their number, three.
inline void setAlbedo(Medium& medium, const std::function<double(Coord, int)>& a, int channels = 1) {
  medium.albedo.assign(channels, Field<float>(medium.topology()));
  for (int c = 0; c < channels; ++c)
    forEachVoxel(medium.topology(),
                 [&](Coord p, size_t i) { medium.albedo[c][i] = static_cast<float>(a(p, c)); });
}

inline Scene sunScene(const Vec3d& direction, const Vec3d& irradiance = Vec3d(1)) {
  Scene scene;
  scene.lights.push_back({"sun", SunLight{direction.unit(), irradiance, 0}});
  return scene;
}

/// The parallelogram with corner p and sides u, v; its front is where u x v points.
inline Mesh quad(const Vec3d& p, const Vec3d& u, const Vec3d& v) {
  return {{p, p + u, p + u + v, p + v}, {{0, 1, 2}, {0, 2, 3}}};
}

}  // namespace vdb_diffuse
