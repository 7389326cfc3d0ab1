#include "reference/scenery.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vdb_diffuse {
namespace {

// Embree keeps positions as floats: a ray that leaves a surface starts this much of all surfaces' extent
// above it, some units in the last place, and at least this much of a voxel.
constexpr double kOffExtent = 2e-7, kOffVoxel = 1e-4;

}  // namespace

VolumeBox::VolumeBox(const Volume& density) {
  const Topology& topology = *density.topology;
  Coord low = topology.highest(), high = topology.lowest();
  for (size_t b = 0; b < topology.blockCount(); ++b)
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const Coord p = topology.origin(b) + voxelLocal(static_cast<int>(it.pos()));
      low.minComponent(p);
      high.maxComponent(p);
    }
  const Transform& transform = density.transform;
  corner_ = transform.toWorld(low.asVec3d() - Vec3d(0.5));
  for (int a = 0; a < 3; ++a) {
    edge_[a] = transform.axis(a) * (high[a] - low[a] + 1.0);
    normal_[a] = edge_[a] / edge_[a].length();
  }
  for (int a = 0; a < 3; ++a) face_area_[a] = edge_[(a + 1) % 3].length() * edge_[(a + 2) % 3].length();
}

bool VolumeBox::meets(const Vec3d& p, const Vec3d& d, double& t_enter, double& t_exit) const {
  t_enter = 0;
  t_exit = std::numeric_limits<double>::infinity();
  for (int a = 0; a < 3; ++a) {
    const double at = (p - corner_).dot(normal_[a]), speed = d.dot(normal_[a]), length = edge_[a].length();
    if (speed == 0) {
      if (at < 0 || at > length) return false;
      continue;
    }
    const double t0 = -at / speed, t1 = (length - at) / speed;
    t_enter = std::max(t_enter, std::min(t0, t1));
    t_exit = std::min(t_exit, std::max(t0, t1));
  }
  return t_enter < t_exit;
}

double VolumeBox::shadow(const Vec3d& d) const {
  double area = 0;
  for (int a = 0; a < 3; ++a) area += std::abs(d.dot(normal_[a])) * face_area_[a];
  return area;
}

Vec3d VolumeBox::facePoint(int axis, bool high, double u, double v) const {
  return corner_ + (high ? edge_[axis] : Vec3d(0)) + edge_[(axis + 1) % 3] * u + edge_[(axis + 2) % 3] * v;
}

Vec3d VolumeBox::litPoint(const Vec3d& d, double u, double v) const {
  double part[3];
  for (int a = 0; a < 3; ++a) part[a] = std::abs(d.dot(normal_[a])) * face_area_[a];
  double at = u * (part[0] + part[1] + part[2]);
  int axis = 0;
  while (axis < 2 && at >= part[axis]) at -= part[axis++];
  while (part[axis] == 0) --axis;
  return facePoint(axis, d.dot(normal_[axis]) < 0, std::clamp(at / part[axis], 0.0, 1.0), v);
}

double VolumeBox::area() const {
  return 2 * (face_area_[0] + face_area_[1] + face_area_[2]);
}

Vec3d VolumeBox::surfacePoint(double u, double v, Vec3d& inward) const {
  double at = u * area();
  int face = 0;
  while (face < 5 && at >= face_area_[face / 2]) at -= face_area_[face++ / 2];
  inward = face % 2 ? -normal_[face / 2] : normal_[face / 2];
  return facePoint(face / 2, face % 2, std::clamp(at / face_area_[face / 2], 0.0, 1.0), v);
}

Vec3d Cone::direction(double u, double v) const {
  const double below = cap * u, s = std::sqrt(below * (2 - below)), phi = 2 * M_PI * v;
  Vec3d x, y;
  frameAbout(axis, x, y);
  return axis * (1 - below) + x * (s * std::cos(phi)) + y * (s * std::sin(phi));
}

Cone coneAround(const Vec3d& p, const Vec3d& centre, double radius) {
  const Vec3d d = centre - p;
  const double distance = d.length();
  if (distance <= radius) return {};
  const double s = radius / distance, c = std::sqrt((1 - s) * (1 + s));
  return {d / distance, c, s * s / (1 + c)};
}

Vec3d cosineDirection(const Vec3d& normal, double u, double v) {
  const double r = std::sqrt(u), phi = 2 * M_PI * v;
  Vec3d x, y;
  frameAbout(normal, x, y);
  return x * (r * std::cos(phi)) + y * (r * std::sin(phi)) + normal * std::sqrt(1 - u);
}

Scenery::Scenery(const Medium& the_medium, const Scene& the_scene)
    : medium(the_medium),
      scene(the_scene),
      occluder(scene.surfaces),
      box(medium.density),
      surfaces(!occluder.empty()),
      surfaces_inside(false) {
  off_surface = kOffVoxel * medium.transform().meanVoxelSize();
  reach = 2 * box.radius();
  if (!surfaces) return;
  const Vec3d low = occluder.lowest(), high = occluder.highest();
  off_surface = std::max(off_surface, kOffExtent * (high - low).length());
  reach += (high - low).length() + (0.5 * (high + low) - box.centre()).length();
  // Conservative: the axis-aligned box of the surfaces against the ball around the volume's box.
  Vec3d gap;
  for (int a = 0; a < 3; ++a) gap[a] = std::max({low[a] - box.centre()[a], box.centre()[a] - high[a], 0.0});
  surfaces_inside = gap.length() <= box.radius();
}

Scenery::SurfacePoint Scenery::pointOf(const Occluder::Hit& hit, const Vec3d& origin,
                                       const Vec3d& direction) const {
  const Mesh& mesh = scene.surfaces[hit.surface].mesh;
  const auto& corner = mesh.triangles[hit.triangle];
  const Vec3d a = mesh.positions[corner[0]];
  Vec3d normal = (mesh.positions[corner[1]] - a).cross(mesh.positions[corner[2]] - a);
  const double length = normal.length();
  normal = length > 0 ? normal / length : -direction;
  return {origin + direction * hit.distance, normal.dot(direction) < 0 ? normal : -normal, hit.surface};
}

double Scenery::reflect(const SurfacePoint& point, RandomStream& random, Vec3d& direction) const {
  const Cone cone = coneAround(point.position, box.centre(), box.radius());
  const double toward = cone.cos_limit > 0.5 ? 0.5 : 0;  // share of directions drawn from the cone
  const double choice = random.uniform(), u = random.uniform(), v = random.uniform();
  direction = choice < toward ? cone.direction(u, v) : cosineDirection(point.normal, u, v);
  const double lobe = std::max(0.0, direction.dot(point.normal)) / M_PI;
  const double density =
      (1 - toward) * lobe + (toward > 0 && cone.contains(direction) ? toward / cone.solidAngle() : 0);
  return density > 0 ? lobe / density : 0;
}

}  // namespace vdb_diffuse
