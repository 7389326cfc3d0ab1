#include "diffusion/reflected_light.h"

#include <tbb/concurrent_hash_map.h>

#include <cmath>

#include "diffusion/light_path.h"

namespace vdb_diffuse {
namespace {

constexpr double kCellVoxels = 2;         ///< a lattice cell beside the volume, in voxels
constexpr double kCellOfDistance = 0.05;  ///< and far from it, as a part of the distance

struct CellKey {
  int32_t surface;
  uint32_t triangle;
  int32_t level, i, j;
  bool front;
  bool operator==(const CellKey& o) const {
    return surface == o.surface && triangle == o.triangle && level == o.level && i == o.i && j == o.j &&
           front == o.front;
  }
};

struct HashCell {
  size_t hash(const CellKey& k) const {
    uint64_t h = 0x9E3779B97F4A7C15ull;
    for (uint64_t part :
         {uint64_t(uint32_t(k.surface)) << 32 | k.triangle, uint64_t(uint32_t(k.i)) << 32 | uint32_t(k.j),
          uint64_t(uint32_t(k.level)) << 1 | (k.front ? 1 : 0)}) {
      h = (h ^ part) * 0xBF58476D1CE4E5B9ull;
      h ^= h >> 31;
    }
    return static_cast<size_t>(h);
  }
  bool equal(const CellKey& a, const CellKey& b) const { return a == b; }
};

}  // namespace

struct ReflectedLight::Impl {
  const Medium& medium;
  const LightSamples& lights;
  const std::vector<Surface>& surfaces;
  const Occluder& occluder;
  const Vec3d sigma_t, sigma_t_beam;
  bool any = false;
  double voxel, enough;
  Vec3d low, high;  // world box of the volume
  mutable tbb::concurrent_hash_map<CellKey, Radiance, HashCell> cells;

  Impl(const Medium& m, const Vec3d& beam, const LightSamples& l, const std::vector<Surface>& s,
       const Occluder& o)
      : medium(m),
        lights(l),
        surfaces(s),
        occluder(o),
        sigma_t(m.optics.sigmaT()),
        sigma_t_beam(beam),
        voxel(m.transform().meanVoxelSize()) {
    const Vec3d thinnest = openvdb::math::minComponent(sigma_t, sigma_t_beam);
    enough = kOpaque / std::min({thinnest[0], thinnest[1], thinnest[2]});
    for (const Surface& surface : surfaces)
      any = any || (!surface.albedo.isZero() && !surface.mesh.triangles.empty());
    any = any && (!lights.beams.empty() || !lights.points.empty()) && medium.topology().blockCount() > 0;
    if (!any) return;
    low = Vec3d(1e300);
    high = Vec3d(-1e300);
    for (int corner = 0; corner < 8; ++corner) {
      const Coord &a = medium.topology().lowest(), &b = medium.topology().highest();
      const Vec3d p = medium.transform().toWorld(
          Vec3d(corner & 1 ? b[0] : a[0], corner & 2 ? b[1] : a[1], corner & 4 ? b[2] : a[2]));
      low = openvdb::math::minComponent(low, p);
      high = openvdb::math::maxComponent(high, p);
    }
  }

  /// Adds light of this irradiance that comes from `toward`, less what the medium takes.
  void add(const Vec3d& power, const Vec3d& from, const Vec3d& toward, double distance, Radiance& sum) const {
    const double column = columnDensity(medium.density, medium.transform().toIndex(from),
                                        medium.transform().directionToIndex(toward), 0, distance, enough);
    for (int c = 0; c < 3; ++c) {
      sum.direct[c] += power[c] * std::exp(-sigma_t[c] * column);
      sum.beam[c] += power[c] * std::exp(-sigma_t_beam[c] * column);
    }
  }

  /// W/m2 on the side of a surface that `normal` points away from.
  Radiance irradiance(const Vec3d& point, const Vec3d& normal) const {
    const Vec3d from = point + normal * (1e-3 * voxel);  // off the surface itself
    Radiance sum;
    for (const BeamSample& beam : lights.beams) {
      const double cosine = -beam.direction.dot(normal);
      constexpr double kFar = std::numeric_limits<double>::infinity();
      if (cosine <= 0 || occluder.hidden(from, -beam.direction, kFar)) continue;
      add(beam.irradiance * cosine, from, -beam.direction, kFar, sum);
    }
    for (const PointSample& light : lights.points) {
      const Vec3d separation = light.position - from;
      const double r = separation.length();
      if (!(r > 0)) continue;
      const Vec3d toward = separation / r;
      const double cosine = toward.dot(normal), falloff = light.falloff(-toward);
      if (cosine <= 0 || falloff <= 0 || occluder.hidden(from, toward, r)) continue;
      add(light.intensity * (cosine * falloff / (r * r)), from, toward, r, sum);
    }
    return sum;
  }
};

ReflectedLight::ReflectedLight(const Medium& medium, const Vec3d& sigma_t_beam, const LightSamples& lights,
                               const std::vector<Surface>& surfaces, const Occluder& occluder)
    : impl_(std::make_unique<Impl>(medium, sigma_t_beam, lights, surfaces, occluder)) {}
ReflectedLight::~ReflectedLight() = default;

bool ReflectedLight::any() const {
  return impl_->any;
}

ReflectedLight::Radiance ReflectedLight::radiance(const Occluder::Hit& hit, const Vec3d& origin,
                                                  const Vec3d& direction) const {
  const Surface& surface = impl_->surfaces[hit.surface];
  if (surface.albedo.isZero()) return {};
  const auto& t = surface.mesh.triangles[hit.triangle];
  const Vec3d &a = surface.mesh.positions[t[0]], &b = surface.mesh.positions[t[1]],
              &c = surface.mesh.positions[t[2]];
  Vec3d normal = (b - a).cross(c - a);
  const double area = normal.length();
  if (!(area > 0)) return {};
  normal /= area;
  const Vec3d u = (b - a) / (b - a).length(), v = normal.cross(u);
  const Vec3d p = origin + direction * hit.distance;

  double outside = 0;
  for (int i = 0; i < 3; ++i) outside = std::max({outside, impl_->low[i] - p[i], p[i] - impl_->high[i]});
  const double wanted = std::max(kCellVoxels * impl_->voxel, kCellOfDistance * outside);
  CellKey key{hit.surface, hit.triangle, std::ilogb(wanted / impl_->voxel), 0, 0, hit.front};
  const double cell = std::ldexp(impl_->voxel, key.level);
  key.i = static_cast<int32_t>(std::clamp(std::floor((p - a).dot(u) / cell), -1e9, 1e9));
  key.j = static_cast<int32_t>(std::clamp(std::floor((p - a).dot(v) / cell), -1e9, 1e9));

  decltype(impl_->cells)::const_accessor found;
  if (impl_->cells.find(found, key)) return found->second;
  const Vec3d middle = a + u * ((key.i + 0.5) * cell) + v * ((key.j + 0.5) * cell);
  Radiance radiance = impl_->irradiance(middle, hit.front ? normal : -normal);
  radiance.direct *= surface.albedo / M_PI;
  radiance.beam *= surface.albedo / M_PI;
  impl_->cells.insert({key, radiance});
  return radiance;
}

}  // namespace vdb_diffuse
