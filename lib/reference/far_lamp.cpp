#include "reference/far_lamp.h"

#include <algorithm>
#include <cmath>

#include "scene/light_samples.h"

namespace vdb_diffuse {
namespace {

/// Light from infinity whose directions are drawn without regard to the place.
class FarLamp : public Lamp {
 public:
  explicit FarLamp(const Scenery& scenery) : scenery_(scenery) {}

  int dimensions() const override { return 4; }
  Ray aimed(const double u[4], RandomStream&) const override {
    Ray ray;
    const Vec3d irradiance = draw(u[2], u[3], ray.direction);
    ray.power = irradiance * scenery_.box.shadow(ray.direction);
    ray.origin = upstream(scenery_.box.litPoint(ray.direction, u[0], u[1]), ray.direction);
    return ray;
  }
  Arrival at(const Vec3d& p, const double u[2], RandomStream&) const override {
    Arrival arrival;
    arrival.irradiance = draw(u[0], u[1], arrival.direction);
    arrival.distance = scenery_.reach + (p - scenery_.box.centre()).length();
    arrival.origin = p - arrival.direction * arrival.distance;
    return arrival;
  }

 protected:
  const Scenery& scenery_;

  /// A direction and its radiance over the density it was drawn from.
  virtual Vec3d draw(double u, double v, Vec3d& direction) const = 0;
  /// Back against the light, to where nothing can stand in its way.
  Vec3d upstream(const Vec3d& p, const Vec3d& direction) const {
    return scenery_.surfaces ? p - direction * scenery_.reach : p;
  }
};

/// A disc of angular radius a and even radiance E / (pi sin^2 a): a plane that faces it receives E.
class SunLamp : public FarLamp {
 public:
  SunLamp(const SunLight& sun, const Scenery& scenery)
      : FarLamp(scenery),
        cone_(Cone::of(sun.direction.unit(), 0.5 * sun.angle)),
        irradiance_(sun.irradiance) {
    if (!(sun.angle > 0)) return;
    const double sine = std::sin(0.5 * sun.angle);
    irradiance_ *= cone_.solidAngle() / (M_PI * sine * sine);
  }
  int dimensions() const override { return 2; }  // a disc is small beside the volume

 private:
  Cone cone_;
  Vec3d irradiance_;

  Vec3d draw(double u, double v, Vec3d& direction) const override {
    direction = cone_.direction(u, v);
    return irradiance_;
  }
};

class UniformDome : public FarLamp {
 public:
  UniformDome(const Vec3d& radiance, const Scenery& scenery) : FarLamp(scenery), radiance_(radiance) {}

  /// Through each face of the box goes pi L per area, by the cosine: every ray has the same power.
  Ray aimed(const double u[4], RandomStream&) const override {
    Ray ray;
    Vec3d inward;
    const Vec3d p = scenery_.box.surfacePoint(u[0], u[1], inward);
    ray.direction = cosineDirection(inward, u[2], u[3]);
    ray.power = radiance_ * (M_PI * scenery_.box.area());
    ray.origin = upstream(p, ray.direction);
    return ray;
  }

 private:
  Vec3d radiance_;

  Vec3d draw(double u, double v, Vec3d& direction) const override {
    direction = Cone{}.direction(u, v);
    return radiance_ * (4 * M_PI);
  }
};

/// An image, drawn by the luminance times solid angle of its pixels; evenly within a pixel.
class ImageDome : public FarLamp {
 public:
  ImageDome(const DomeLight& dome, const Scenery& scenery) : FarLamp(scenery), dome_(dome) {
    const Image& image = *dome.image;
    for (int y = 0; y < image.height; ++y) {
      const double solid = pixelSolidAngle(y);
      for (int x = 0; x < image.width; ++x) {
        const Vec3d rgb = dome.radiance * Vec3d(image.pixels[static_cast<size_t>(y) * image.width + x]);
        total_ += (0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]) * solid;
        cumulative_.push_back(total_);
      }
    }
  }
  bool dark() const { return !(total_ > 0); }

 private:
  const DomeLight& dome_;
  double total_ = 0;
  std::vector<double> cumulative_;

  double rowCosine(double y) const { return std::cos(M_PI * y / dome_.image->height); }
  double pixelSolidAngle(int y) const {
    return (rowCosine(y) - rowCosine(y + 1)) * 2 * M_PI / dome_.image->width;
  }
  Vec3d draw(double u, double v, Vec3d& direction) const override {
    const int width = dome_.image->width;
    const double at = u * total_;
    const size_t n =
        std::min<size_t>(std::upper_bound(cumulative_.begin(), cumulative_.end(), at) - cumulative_.begin(),
                         cumulative_.size() - 1);
    const double before = n > 0 ? cumulative_[n - 1] : 0, mass = cumulative_[n] - before;
    const int x = static_cast<int>(n % width), y = static_cast<int>(n / width);
    const double across = std::clamp((at - before) / mass, 0.0, 1.0);
    const double phi = M_PI - 2 * M_PI * (x + across) / width + dome_.rotation;
    const double z = rowCosine(y) + (rowCosine(y + 1) - rowCosine(y)) * v;
    const double r = std::sqrt(std::max(0.0, 1 - z * z));
    direction = -Vec3d(r * std::cos(phi), r * std::sin(phi), z);
    const Vec3d rgb = dome_.radiance * Vec3d(dome_.image->pixels[n]);
    return rgb * (pixelSolidAngle(y) * total_ / mass);
  }
};

}  // namespace

std::unique_ptr<Lamp> sunLamp(const SunLight& sun, const Scenery& scenery) {
  if (sun.irradiance.isZero()) return nullptr;
  return std::make_unique<SunLamp>(sun, scenery);
}

std::unique_ptr<Lamp> domeLamp(const DomeLight& dome, const Scenery& scenery) {
  if (dome.radiance.isZero()) return nullptr;
  if (!dome.image) return std::make_unique<UniformDome>(dome.radiance, scenery);
  auto lamp = std::make_unique<ImageDome>(dome, scenery);
  if (lamp->dark()) return nullptr;
  return lamp;
}

}  // namespace vdb_diffuse
