#include "scene/light_samples.h"

#include <algorithm>
#include <cmath>

#include "scene/dome_samples.h"

namespace vdb_diffuse {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Two unit vectors that make a right-handed frame with unit `z`; Duff et al., "Building an orthonormal
/// basis, revisited" (2017).
void frame(const Vec3d& z, Vec3d& x, Vec3d& y) {
  const double sign = std::copysign(1.0, z[2]), a = -1 / (sign + z[2]), b = z[0] * z[1] * a;
  x = Vec3d(1 + sign * z[0] * z[0] * a, sign * b, -sign * z[0]);
  y = Vec3d(b, sign + z[1] * z[1] * a, -z[1]);
}

/// A wide sun is a disc of even radiance E / (pi sin^2 a), a half its angle, cut into rings of equal solid
/// angle with one beam each on a golden-angle spiral. A plane that faces it receives E exactly.
void sample(const SunLight& sun, const LightSampling& settings, LightSamples& samples) {
  if (sun.irradiance == Vec3d(0)) return;
  const Vec3d axis = sun.direction.unit();
  const int count = sun.angle > settings.sharp_sun ? std::max(settings.sun_directions, 1) : 1;
  if (count == 1) {
    samples.beams.push_back({axis, sun.irradiance});
    return;
  }
  Vec3d x, y;
  frame(axis, x, y);
  const double cap = 1 - std::cos(0.5 * sun.angle), golden_angle = kPi * (3 - std::sqrt(5.0));
  const double sum_of_cosines = count * (1 - 0.5 * cap);
  for (int i = 0; i < count; ++i) {
    const double c = 1 - cap * (i + 0.5) / count, s = std::sqrt(1 - c * c), phi = golden_angle * i;
    samples.beams.push_back(
        {axis * c + x * (s * std::cos(phi)) + y * (s * std::sin(phi)), sun.irradiance / sum_of_cosines});
  }
}

void sample(const PointLight& light, const LightSampling& settings, LightSamples& samples) {
  if (light.intensity == Vec3d(0)) return;
  const int count = light.radius > 0 ? std::max(settings.ball_points, 1) : 1;
  PointSample point;
  point.position = light.position;
  point.intensity = light.intensity / count;
  if (count == 1) {
    samples.points.push_back(point);
    return;
  }
  for (const Vec3d& d : sphereDirections(count)) {
    point.position = light.position + d * light.radius;
    samples.points.push_back(point);
  }
}

/// As Cycles: `angle` is the full cone, and with c the cosine to the axis the intensity falls by
/// smoothstep((c - cos_outer) / (cos_inner - cos_outer)), cos_outer = cos(angle / 2) and
/// cos_inner = cos_outer + blend (1 - cos_outer).
void sample(const SpotLight& light, const LightSampling&, LightSamples& samples) {
  if (light.intensity == Vec3d(0)) return;
  PointSample point;
  point.profile = PointSample::Profile::kSpot;
  point.position = light.position;
  point.axis = light.direction.unit();
  point.intensity = light.intensity;
  point.cos_outer = std::cos(0.5 * light.angle);
  point.cos_inner = point.cos_outer + light.blend * (1 - point.cos_outer);
  samples.points.push_back(point);
}

/// Point i of a sequence that fills a triangle evenly: its digits in base 4 choose a quarter, and a quarter
/// of that. 4^k points are the centres of 4^k equal triangles. Basu and Owen, "Low discrepancy constructions
/// in the triangle" (2015).
Vec3d trianglePoint(uint32_t i, Vec3d a, Vec3d b, Vec3d c) {
  for (; i > 0; i /= 4) {
    const Vec3d ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
    const uint32_t quarter = i % 4;
    if (quarter == 0) {  // the middle one, upside down
      a = bc, b = ca, c = ab;
    } else if (quarter == 1) {
      b = ab, c = ca;
    } else if (quarter == 2) {
      a = ab, c = bc;
    } else {
      a = ca, b = bc;
    }
  }
  return (a + b + c) / 3.0;
}

/// Equal pieces of the area, shared out along the list of triangles; each shines L A / count along its
/// normal.
void sample(const AreaLight& light, const LightSampling& settings, LightSamples& samples) {
  if (light.radiance == Vec3d(0)) return;
  const auto corner = [&](size_t t, int i) { return light.mesh.positions[light.mesh.triangles[t][i]]; };
  const auto doubleArea = [&](size_t t) {
    return (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0));
  };
  double area = 0;
  for (size_t t = 0; t < light.mesh.triangles.size(); ++t) area += 0.5 * doubleArea(t).length();
  if (!(area > 0)) return;

  const int count = std::max(settings.area_points, 1);
  PointSample point;
  point.profile = PointSample::Profile::kCosine;
  point.intensity = light.radiance * (area / count);
  double passed = 0;
  int taken = 0;
  for (size_t t = 0; t < light.mesh.triangles.size(); ++t) {
    const Vec3d normal = doubleArea(t);
    if (!(normal.length() > 0)) continue;
    passed += 0.5 * normal.length();
    point.axis = normal.unit();
    for (uint32_t i = 0; taken < count && (taken + 0.5) * area < passed * count; ++i, ++taken) {
      point.position = trianglePoint(i, corner(t, 0), corner(t, 1), corner(t, 2));
      samples.points.push_back(point);
    }
  }
}

void sample(const DomeLight& light, const LightSampling& settings, LightSamples& samples) {
  const std::vector<BeamSample> beams = sampleDome(light, settings.dome_directions);
  samples.beams.insert(samples.beams.end(), beams.begin(), beams.end());
}

}  // namespace

double PointSample::falloff(const Vec3d& direction) const {
  if (profile == Profile::kIsotropic) return 1;
  const double c = axis.dot(direction);
  if (profile == Profile::kCosine) return std::max(0.0, c);
  if (c <= cos_outer) return 0;
  if (c >= cos_inner) return 1;
  const double t = (c - cos_outer) / (cos_inner - cos_outer);
  return t * t * (3 - 2 * t);
}

LightSamples sampleLights(const Scene& scene, const LightSampling& settings) {
  LightSamples samples;
  for (const NamedLight& named : scene.lights) {
    const size_t first = samples.beams.size();
    std::visit([&](const auto& light) { sample(light, settings, samples); }, named.light);
    for (size_t i = first; i < samples.beams.size(); ++i) {
      samples.beams[i].index = static_cast<int>(i - first);
      samples.beams[i].count = static_cast<int>(samples.beams.size() - first);
    }
  }
  return samples;
}

}  // namespace vdb_diffuse
