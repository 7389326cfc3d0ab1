#include "reference/lamp.h"

#include <algorithm>
#include <cmath>

#include "reference/far_lamp.h"
#include "scene/light_samples.h"

namespace vdb_diffuse {
namespace {

/// A point, a spot, or a ball whose surface shines outward: radiance I / (pi r^2), intensity I far away.
class BallLamp : public Lamp {
 public:
  BallLamp(PointSample point, double radius, Cone beam, const Scenery& scenery)
      : point_(point), radius_(radius), beam_(beam), scenery_(scenery) {}

  int dimensions() const override { return radius_ > 0 ? 4 : 2; }
  Ray aimed(const double u[4], RandomStream&) const override {
    Ray ray;
    Vec3d normal(0);
    ray.origin = surfacePoint(u[2], u[3], normal);
    Cone cone = coneAround(ray.origin, scenery_.box.centre(), scenery_.box.radius());
    if (beam_.cos_limit > cone.cos_limit) cone = beam_;
    ray.direction = cone.direction(u[0], u[1]);
    // Over the ball's area A = 4 pi r^2, L A cos = 4 I cos.
    const double cosine = radius_ > 0 ? 4 * std::max(0.0, normal.dot(ray.direction)) : 1;
    ray.power = point_.intensity * (point_.falloff(ray.direction) * cosine * cone.solidAngle());
    return ray;
  }
  Arrival at(const Vec3d& p, const double u[2], RandomStream&) const override {
    Arrival arrival;
    Vec3d normal(0);
    arrival.origin = surfacePoint(u[0], u[1], normal);
    const Vec3d d = p - arrival.origin;
    arrival.distance = d.length();
    if (!(arrival.distance > 0)) return arrival;
    arrival.direction = d / arrival.distance;
    const double cosine = radius_ > 0 ? 4 * std::max(0.0, normal.dot(arrival.direction)) : 1;
    arrival.irradiance = point_.intensity * (point_.falloff(arrival.direction) * cosine / d.lengthSqr());
    return arrival;
  }

 private:
  PointSample point_;
  double radius_;
  Cone beam_;
  const Scenery& scenery_;

  Vec3d surfacePoint(double u, double v, Vec3d& normal) const {
    if (radius_ <= 0) return point_.position;
    normal = Cone{}.direction(u, v);
    return point_.position + normal * radius_;
  }
};

/// Triangles of even radiance, from their front.
class AreaLamp : public Lamp {
 public:
  AreaLamp(const AreaLight& light, const Scenery& scenery) : light_(light), scenery_(scenery) {
    for (const auto& t : light_.mesh.triangles) {
      const Vec3d a = light_.mesh.positions[t[0]];
      area_ += 0.5 * (light_.mesh.positions[t[1]] - a).cross(light_.mesh.positions[t[2]] - a).length();
      cumulative_.push_back(area_);
    }
  }
  int dimensions() const override { return 4; }
  bool dark() const { return !(area_ > 0) || light_.radiance.isZero(); }

  Ray aimed(const double u[4], RandomStream&) const override {
    Ray ray;
    Vec3d normal(0);
    ray.origin = point(u[2], u[3], normal);
    const Cone cone = coneAround(ray.origin, scenery_.box.centre(), scenery_.box.radius());
    if (cone.cos_limit > 0.5) {
      ray.direction = cone.direction(u[0], u[1]);
      ray.power = light_.radiance * (area_ * std::max(0.0, normal.dot(ray.direction)) * cone.solidAngle());
    } else {
      ray.direction = cosineDirection(normal, u[0], u[1]);
      ray.power = light_.radiance * (area_ * M_PI);
    }
    return ray;
  }
  Arrival at(const Vec3d& p, const double u[2], RandomStream&) const override {
    Arrival arrival;
    Vec3d normal(0);
    arrival.origin = point(u[0], u[1], normal);
    const Vec3d d = p - arrival.origin;
    arrival.distance = d.length();
    if (!(arrival.distance > 0)) return arrival;
    arrival.direction = d / arrival.distance;
    arrival.irradiance =
        light_.radiance * (area_ * std::max(0.0, normal.dot(arrival.direction)) / d.lengthSqr());
    return arrival;
  }

 private:
  const AreaLight& light_;
  const Scenery& scenery_;
  double area_ = 0;
  std::vector<double> cumulative_;

  Vec3d point(double u, double v, Vec3d& normal) const {
    const double at = u * area_;
    const size_t t =
        std::min<size_t>(std::upper_bound(cumulative_.begin(), cumulative_.end(), at) - cumulative_.begin(),
                         cumulative_.size() - 1);
    const double before = t > 0 ? cumulative_[t - 1] : 0;
    const double root = std::sqrt(std::clamp((at - before) / (cumulative_[t] - before), 0.0, 1.0));
    const auto& corner = light_.mesh.triangles[t];
    const Vec3d &a = light_.mesh.positions[corner[0]], &b = light_.mesh.positions[corner[1]],
                &c = light_.mesh.positions[corner[2]];
    normal = (b - a).cross(c - a).unit();
    return a + (b - a) * (root * (1 - v)) + (c - a) * (root * v);
  }
};

struct LampMaker {
  const Scenery& scenery;

  std::unique_ptr<Lamp> operator()(const SunLight& sun) const { return sunLamp(sun, scenery); }
  std::unique_ptr<Lamp> operator()(const DomeLight& dome) const { return domeLamp(dome, scenery); }
  std::unique_ptr<Lamp> operator()(const PointLight& light) const {
    if (light.intensity.isZero()) return nullptr;
    PointSample point;
    point.position = light.position;
    point.intensity = light.intensity;
    return std::make_unique<BallLamp>(point, light.radius, Cone{}, scenery);
  }
  std::unique_ptr<Lamp> operator()(const SpotLight& light) const {
    if (light.intensity.isZero()) return nullptr;
    PointSample point;
    point.profile = PointSample::Profile::kSpot;
    point.position = light.position;
    point.axis = light.direction.unit();
    point.intensity = light.intensity;
    point.cos_outer = std::cos(0.5 * light.angle);
    point.cos_inner = point.cos_outer + light.blend * (1 - point.cos_outer);
    return std::make_unique<BallLamp>(point, 0, Cone::of(point.axis, 0.5 * light.angle), scenery);
  }
  std::unique_ptr<Lamp> operator()(const AreaLight& light) const {
    auto lamp = std::make_unique<AreaLamp>(light, scenery);
    if (lamp->dark()) return nullptr;
    return lamp;
  }
};

}  // namespace

std::unique_ptr<Lamp> lampOf(const Light& light, const Scenery& scenery) {
  return std::visit(LampMaker{scenery}, light);
}

}  // namespace vdb_diffuse
