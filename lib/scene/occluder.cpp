#include "scene/occluder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <new>
#include <stdexcept>
#include <string>

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace vdb_diffuse {
namespace {

// Embree leaves out primitives with a coordinate beyond this (its FLT_LARGE), without a word.
constexpr double kLargestCoordinate = 1.844e18;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Box {
  Vec3d lowest{kInfinity}, highest{-kInfinity};

  void add(const Vec3d& p) {
    for (int a = 0; a < 3; ++a) {
      lowest[a] = std::min(lowest[a], p[a]);
      highest[a] = std::max(highest[a], p[a]);
    }
  }
  /// Part of the ray p + t d, t_min <= t <= t_max, inside this box. False where there is none.
  bool clip(const Vec3d& p, const Vec3d& d, double& t_min, double& t_max) const {
    for (int a = 0; a < 3; ++a) {
      if (d[a] == 0) {
        if (p[a] < lowest[a] || p[a] > highest[a]) return false;
        continue;
      }
      const double t0 = (lowest[a] - p[a]) / d[a], t1 = (highest[a] - p[a]) / d[a];
      t_min = std::max(t_min, std::min(t0, t1));
      t_max = std::min(t_max, std::max(t0, t1));
    }
    return t_min <= t_max;
  }
};

void checkSurface(const Surface& surface, size_t index) {
  const auto refuse = [&](const std::string& what) {
    throw std::invalid_argument("surface " + std::to_string(index) +
                                (surface.name.empty() ? "" : " '" + surface.name + "'") + ": " + what);
  };
  const Mesh& mesh = surface.mesh;
  for (size_t i = 0; i < mesh.positions.size(); ++i)
    for (int a = 0; a < 3; ++a)
      if (!(std::abs(mesh.positions[i][a]) <= kLargestCoordinate / 2))
        refuse("position " + std::to_string(i) + " is not finite or too large");
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    for (uint32_t corner : mesh.triangles[t])
      if (corner >= mesh.positions.size())
        refuse("triangle " + std::to_string(t) + " has an index out of range");
  if (mesh.triangles.size() >= RTC_INVALID_GEOMETRY_ID || mesh.positions.size() >= RTC_INVALID_GEOMETRY_ID)
    refuse("too many triangles");
}

}  // namespace

struct Occluder::Impl {
  /// What Embree holds of one surface; the same floats serve the exact distance of a hit.
  struct Piece {
    const float* positions = nullptr;
    const uint32_t* corners = nullptr;
    size_t triangles = 0;
    Vec3d position(uint32_t i) const {
      return Vec3d(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]);
    }
  };

  Box box;       // world
  Vec3d centre;  // world position of Embree's origin
  double margin = 0;
  std::vector<Piece> pieces;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  ~Impl() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
  void throwOnError() const {
    const RTCError error = rtcGetDeviceError(device);
    if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
    if (error != RTC_ERROR_NONE) throw std::runtime_error("Embree error " + std::to_string(error));
  }
  void add(const Mesh& mesh, unsigned id) {
    if (mesh.triangles.empty()) return;
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* positions = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.positions.size()));
    auto* corners = static_cast<uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(uint32_t), mesh.triangles.size()));
    if (positions && corners) {
      for (size_t i = 0; i < mesh.positions.size(); ++i)
        for (int a = 0; a < 3; ++a)
          positions[3 * i + a] = static_cast<float>(mesh.positions[i][a] - centre[a]);
      for (size_t t = 0; t < mesh.triangles.size(); ++t)
        std::copy(mesh.triangles[t].begin(), mesh.triangles[t].end(), corners + 3 * t);
      rtcCommitGeometry(geometry);
      rtcAttachGeometryByID(scene, geometry, id);
      pieces[id] = {positions, corners, mesh.triangles.size()};
    }
    rtcReleaseGeometry(geometry);  // the scene keeps it
    throwOnError();
  }
  /// The part of the ray that can meet anything, as Embree's ray; t_start is where it begins on ours. Moving
  /// the start to the box in double keeps the precision of origins far from the surfaces.
  bool localRay(const Vec3d& origin, const Vec3d& direction, double distance, RTCRay& ray,
                double& t_start) const {
    t_start = 0;
    double t_end = distance;
    if (!box.clip(origin, direction, t_start, t_end)) return false;
    t_start = std::max(0.0, t_start - margin);
    const Vec3d p = origin + direction * t_start - centre;
    ray.org_x = static_cast<float>(p[0]);
    ray.org_y = static_cast<float>(p[1]);
    ray.org_z = static_cast<float>(p[2]);
    ray.dir_x = static_cast<float>(direction[0]);
    ray.dir_y = static_cast<float>(direction[1]);
    ray.dir_z = static_cast<float>(direction[2]);
    ray.tnear = 0;
    ray.tfar = static_cast<float>(distance - t_start);
    ray.time = 0;
    ray.mask = ~0u;
    ray.id = 0;
    ray.flags = 0;
    return true;
  }
};

Occluder::Occluder(const std::vector<Surface>& surfaces) : impl_(std::make_unique<Impl>()) {
  for (size_t i = 0; i < surfaces.size(); ++i) {
    checkSurface(surfaces[i], i);
    for (const auto& triangle : surfaces[i].mesh.triangles)
      for (uint32_t corner : triangle) impl_->box.add(surfaces[i].mesh.positions[corner]);
  }
  if (empty()) return;
  impl_->centre = (impl_->box.lowest + impl_->box.highest) * 0.5;
  // Float coordinates may lie outside the box by their rounding, so a ray starts that much before it.
  impl_->margin = 1e-5 * (impl_->box.highest - impl_->box.lowest).length();
  for (int a = 0; a < 3; ++a) {
    impl_->box.lowest[a] -= impl_->margin;
    impl_->box.highest[a] += impl_->margin;
  }
  impl_->device = rtcNewDevice(nullptr);
  if (!impl_->device) throw std::runtime_error("Embree did not start");
  impl_->scene = rtcNewScene(impl_->device);
  rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST);  // no light through the edge two triangles share
  impl_->pieces.resize(surfaces.size());
  for (size_t i = 0; i < surfaces.size(); ++i) impl_->add(surfaces[i].mesh, static_cast<unsigned>(i));
  rtcCommitScene(impl_->scene);
  impl_->throwOnError();
}

Occluder::~Occluder() = default;
Occluder::Occluder(Occluder&&) noexcept = default;
Occluder& Occluder::operator=(Occluder&&) noexcept = default;

bool Occluder::empty() const {
  return impl_->box.lowest[0] > impl_->box.highest[0];
}
Vec3d Occluder::lowest() const {
  return impl_->box.lowest + Vec3d(impl_->margin);
}
Vec3d Occluder::highest() const {
  return impl_->box.highest - Vec3d(impl_->margin);
}

bool Occluder::comesNear(const Vec3d& lowest, const Vec3d& highest) const {
  for (const Impl::Piece& piece : impl_->pieces)
    for (size_t t = 0; t < piece.triangles; ++t) {
      Box box;
      for (int n = 0; n < 3; ++n) box.add(piece.position(piece.corners[3 * t + n]) + impl_->centre);
      bool meets = true;
      for (int a = 0; a < 3; ++a)
        meets = meets && box.lowest[a] - impl_->margin <= highest[a] &&
                box.highest[a] + impl_->margin >= lowest[a];
      if (meets) return true;
    }
  return false;
}

std::optional<Occluder::Hit> Occluder::closest(const Vec3d& origin, const Vec3d& direction,
                                               double distance) const {
  RTCRayHit query;
  double t_start;
  if (empty() || !impl_->localRay(origin, direction, distance, query.ray, t_start)) return std::nullopt;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
  rtcIntersect1(impl_->scene, &query);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(impl_->scene, &context, &query);
#endif
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;

  Hit hit;
  hit.surface = static_cast<int>(query.hit.geomID);
  hit.triangle = query.hit.primID;
  hit.u = query.hit.u;
  hit.v = query.hit.v;
  // Embree's distance is a float. The triangle's plane gives it in double, except where the ray grazes it.
  const Impl::Piece& piece = impl_->pieces[hit.surface];
  const uint32_t* corner = piece.corners + 3 * size_t(hit.triangle);
  const Vec3d a = piece.position(corner[0]);
  const Vec3d normal = (piece.position(corner[1]) - a).cross(piece.position(corner[2]) - a);
  const double facing = normal.dot(direction);
  hit.front = facing < 0;
  const double t_embree = t_start + query.ray.tfar,
               t_plane = normal.dot(a - (origin - impl_->centre)) / facing;
  const bool agree = std::abs(t_plane - t_embree) <= impl_->margin;  // false for 0/0 too
  hit.distance = std::max(0.0, agree ? t_plane : t_embree);
  return hit;
}

bool Occluder::hidden(const Vec3d& origin, const Vec3d& direction, double distance) const {
  RTCRay ray;
  double t_start;
  if (empty() || !impl_->localRay(origin, direction, distance, ray, t_start)) return false;
#if RTC_VERSION_MAJOR >= 4
  rtcOccluded1(impl_->scene, &ray);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(impl_->scene, &context, &ray);
#endif
  return ray.tfar < 0;  // Embree's way to say yes
}

}  // namespace vdb_diffuse
