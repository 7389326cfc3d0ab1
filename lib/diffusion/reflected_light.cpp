#include "diffusion/reflected_light.h"

#include <tbb/concurrent_hash_map.h>

#include <cmath>

#include "diffusion/light_path.h"
#include "surfaces/polygon.h"

namespace vdb_diffuse {
namespace {

constexpr double kCellVoxels = 2;         ///< a lattice cell beside the volume, in voxels
constexpr double kCellOfDistance = 0.05;  ///< and far from it, as a part of the distance

struct LatticeCell {
  int32_t surface;
  uint32_t triangle;
  int32_t level, i, j;
  bool front;
  bool operator==(const LatticeCell& o) const {
    return surface == o.surface && triangle == o.triangle && level == o.level && i == o.i && j == o.j &&
           front == o.front;
  }
};

struct HashCell {
  size_t hash(const LatticeCell& k) const {
    uint64_t h = 0x9E3779B97F4A7C15ull;
    for (uint64_t part :
         {uint64_t(uint32_t(k.surface)) << 32 | k.triangle, uint64_t(uint32_t(k.i)) << 32 | uint32_t(k.j),
          uint64_t(uint32_t(k.level)) << 1 | (k.front ? 1 : 0)}) {
      h = (h ^ part) * 0xBF58476D1CE4E5B9ull;
      h ^= h >> 31;
    }
    return static_cast<size_t>(h);
  }
  bool equal(const LatticeCell& a, const LatticeCell& b) const { return a == b; }
};

/// A triangle in its own plane: a at the origin, b on the first axis.
struct Plane {
  Vec3d a, u, v, normal;  // world
  double b_u, c_u, c_v;
  bool flat;  // has an area

  Plane(const Mesh& mesh, uint32_t triangle) {
    const auto& t = mesh.triangles[triangle];
    a = mesh.positions[t[0]];
    const Vec3d b = mesh.positions[t[1]] - a, c = mesh.positions[t[2]] - a;
    normal = b.cross(c);
    const double area = normal.length();
    flat = area > 0;
    if (!flat) return;
    normal /= area;
    b_u = b.length();
    u = b / b_u;
    v = normal.cross(u);
    c_u = c.dot(u);
    c_v = c.dot(v);
  }

  /// The middle of what of the triangle lies in a cell of the lattice: never off the triangle, where a
  /// neighbour may hide it. Its cell's own where rounding has led to a cell beside the triangle.
  Vec3d middleOf(const LatticeCell& key, double cell) const {
    std::vector<Vec3d> polygon{Vec3d(0), Vec3d(b_u, 0, 0), Vec3d(c_u, c_v, 0)};
    const int32_t place[2] = {key.i, key.j};
    for (int axis = 0; axis < 2; ++axis) {
      clip(polygon, axis, place[axis] * cell, 1);
      clip(polygon, axis, (place[axis] + 1.0) * cell, -1);
    }
    Vec3d sum(0);
    double area = 0;
    for (size_t n = 2; n < polygon.size(); ++n) {
      const double part = (polygon[n - 1] - polygon[0]).cross(polygon[n] - polygon[0])[2];
      sum += part / 3 * (polygon[0] + polygon[n - 1] + polygon[n]);
      area += part;
    }
    const Vec3d middle = area > 0 ? sum / area : Vec3d((key.i + 0.5) * cell, (key.j + 0.5) * cell, 0);
    return a + u * middle[0] + v * middle[1];
  }
};

}  // namespace

struct ReflectedLight::Impl {
  const BeamMedium& beams;
  const Medium& medium;
  const LightSamples& lights;
  const std::vector<Surface>& surfaces;
  const Occluder& occluder;
  bool any = false;
  double voxel;
  Vec3d low, high;  // world box of the volume
  struct Cell {
    SurfacePoint middle;
    Radiance radiance;
    bool crowded;  // a wall may stand on it
  };
  mutable tbb::concurrent_hash_map<LatticeCell, Cell, HashCell> cells;
  std::unique_ptr<const BouncedLight> bounced;  // once it is known

  Impl(const BeamMedium& m, const LightSamples& l, const std::vector<Surface>& s, const Occluder& o)
      : beams(m),
        medium(m.medium()),
        lights(l),
        surfaces(s),
        occluder(o),
        voxel(medium.transform().meanVoxelSize()) {
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
    const TwofoldLight through = beams.transmittance(from, toward, distance);
    sum.direct += power * through.direct;
    sum.beam += power * through.beam;
  }

  /// W/m2 on the side of a surface that `normal` points away from.
  Radiance irradiance(const SurfacePoint& at) const {
    const Vec3d from = offSurface(at, voxel, occluder), &normal = at.normal;
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

  /// Of the lights' own light, and bounced light once it is known.
  Radiance radiance(const Occluder::Hit& hit, const Vec3d& origin, const Vec3d& direction) const {
    const Surface& surface = surfaces[hit.surface];
    if (surface.albedo.isZero()) return {};
    const Plane plane(surface.mesh, hit.triangle);
    if (!plane.flat) return {};
    const Vec3d p = origin + direction * hit.distance;
    double outside = 0;
    for (int i = 0; i < 3; ++i) outside = std::max({outside, low[i] - p[i], p[i] - high[i]});
    const double wanted = std::max(kCellVoxels * voxel, kCellOfDistance * outside);
    LatticeCell key{hit.surface, hit.triangle, std::ilogb(wanted / voxel), 0, 0, hit.front};
    const double cell = cellSize(key);
    key.i = static_cast<int32_t>(std::clamp(std::floor((p - plane.a).dot(plane.u) / cell), -1e9, 1e9));
    key.j = static_cast<int32_t>(std::clamp(std::floor((p - plane.a).dot(plane.v) / cell), -1e9, 1e9));

    Cell kept;
    if (decltype(cells)::const_accessor found; cells.find(found, key)) {
      kept = found->second;
    } else {
      kept.middle = {plane.middleOf(key, cell), hit.front ? plane.normal : -plane.normal};
      kept.radiance = radianceAt(kept.middle, key);
      kept.crowded = crowded(kept.middle, std::sqrt(2.0) * cell, voxel, occluder);
      cells.insert({key, kept});
    }
    if (kept.crowded)
      if (const SurfacePoint met{p, kept.middle.normal}; !seeEachOther(met, kept.middle, voxel, occluder))
        return radianceAt(met, key);
    return kept.radiance;
  }

  Radiance radianceAt(const SurfacePoint& at, const LatticeCell& on) const {
    Radiance radiance = irradiance(at);
    radiance.direct *= surfaces[on.surface].albedo / M_PI;
    radiance.beam *= surfaces[on.surface].albedo / M_PI;
    if (bounced) addBounced(at, on, radiance);
    return radiance;
  }

  double cellSize(const LatticeCell& key) const { return std::ldexp(voxel, key.level); }

  void addBounced(const SurfacePoint& at, const LatticeCell& on, Radiance& radiance) const {
    const TwofoldLight E = bounced->irradiance(on.surface, on.triangle, on.front, at);
    radiance.direct += E.direct * surfaces[on.surface].albedo / M_PI;
    radiance.beam += E.beam * surfaces[on.surface].albedo / M_PI;
  }

  void followBounces() {
    auto found = std::make_unique<const BouncedLight>(
        beams, surfaces, occluder,
        [this](const Occluder::Hit& hit, const Vec3d& origin, const Vec3d& direction) {
          return radiance(hit, origin, direction);
        });
    if (found->bounces() == 0) return;
    bounced = std::move(found);
    for (auto& [key, cell] : cells) addBounced(cell.middle, key, cell.radiance);
  }
};

ReflectedLight::ReflectedLight(const BeamMedium& medium, const LightSamples& lights,
                               const std::vector<Surface>& surfaces, const Occluder& occluder)
    : impl_(std::make_unique<Impl>(medium, lights, surfaces, occluder)) {
  if (impl_->any) impl_->followBounces();
}
ReflectedLight::~ReflectedLight() = default;

bool ReflectedLight::any() const {
  return impl_->any;
}

ReflectedLight::Radiance ReflectedLight::radiance(const Occluder::Hit& hit, const Vec3d& origin,
                                                  const Vec3d& direction) const {
  return impl_->radiance(hit, origin, direction);
}

}  // namespace vdb_diffuse
