#include "diffusion/light_march.h"

#include <algorithm>
#include <cmath>

#include "diffusion/beam_faces.h"
#include "diffusion/source_shape.h"

namespace vdb_diffuse {
namespace {

constexpr double kInverseSphere = 1 / (4 * M_PI);
constexpr double kFar = std::numeric_limits<double>::infinity();
/// A cube nearer to a lamp than this many of its radii is cut into eight, down to the finest side in voxels.
constexpr double kNearLamp = 4, kFinestCube = 1.0 / 64;

/// A cube near a lamp of more optical depths is cut as well, down to this side, unless the light is gone
/// before it.
constexpr double kThickCube = 1, kFinestThickCube = 0.25, kGoneBefore = 6;

/// Optical depth across a voxel's diagonal from which light is followed from the faces. One chord through the
/// middle of voxels of one optical depth lets 3 % of a lamp's light get away.
constexpr double kThickVoxel = 0.5;

/// Points of a voxel relative to its centre. They come in opposite pairs: were their mean not the centre,
/// every voxel would see the beam too early or too late.
Vec3d pointWithin(int ray, int rays) {
  if (ray == rays - 1 && rays % 2 == 1) return Vec3d(0);
  const Vec3d u(spreadPoint(ray / 2, 0, 3), spreadPoint(ray / 2, 1, 3), spreadPoint(ray / 2, 2, 3));
  return ray % 2 ? -u : u;
}

using Rule = std::vector<std::pair<double, double>>;

/// Places and weights on -1/2 .. 1/2 that integrate polynomials of degree 2n - 1 exactly (Gauss and
/// Legendre). Light that enters a thick voxel through a side does so beside an edge, which evenly spaced
/// points miss.
Rule gaussRule(int n) {
  Rule rule;
  for (int i = 0; i < n; ++i) {
    double x = std::cos(M_PI * (i + 0.75) / (n + 0.5)), slope = 1;
    for (int step = 0; step < 6; ++step) {  // Newton's; p is the n-th Legendre polynomial
      double p = 1, before = 0;
      for (int k = 1; k <= n; ++k) {
        const double next = ((2 * k - 1) * x * p - (k - 1) * before) / k;
        before = p;
        p = next;
      }
      slope = n * (x * p - before) / (x * x - 1);
      x -= p / slope;
    }
    rule.emplace_back(0.5 * x, 1 / ((1 - x * x) * slope * slope));
  }
  return rule;
}

/// The rule's points on each face of the voxel about `centre`: visit(p, axis, side, weight), side -1 or 1.
template <typename Visit>
void forEachFacePoint(const Vec3d& centre, const Rule& rule, const Visit& visit) {
  for (int face = 0; face < 6; ++face)
    for (const auto& [u, of_u] : rule)
      for (const auto& [v, of_v] : rule) {
        const int a = face / 2, side = face % 2 ? 1 : -1;
        Vec3d p = centre;
        p[a] += 0.5 * side;
        p[(a + 1) % 3] += u;
        p[(a + 2) % 3] += v;
        visit(p, a, side, of_u * of_v);
      }
}

Vec3d alongAxes(const Transform& transform, const Vec3d& direction) {
  Vec3d s;
  for (int a = 0; a < 3; ++a) s[a] = direction.dot(transform.axis(a)) / transform.axis(a).length();
  return s;
}

}  // namespace

double spreadPoint(int n, int axis, int dimensions) {
  const double phi = dimensions == 2 ? 1.32471795724474602596 : 1.22074408460575947536;
  const double u = (n + 0.5) / std::pow(phi, axis + 1);
  return u - std::floor(u + 0.5);
}

/// A part of a voxel, a cube, that light passes as if all beside it were like it.
struct LightMarch::Part {
  Vec3d offset{0, 0, 0};  ///< of its centre from the voxel's, in voxels
  double side = 1;        ///< in voxels
  TwofoldDensity density;
};

LightMarch::LightMarch(const BeamMedium& medium, int channels, const Occluder& occluder,
                       const LightSamples& lights, const ReflectedLight& reflected,
                       const std::vector<Vec3d>& reflected_directions, const FirstScatterSettings& settings)
    : beams_(medium),
      medium_(medium.medium()),
      occluder_(occluder),
      lights_(lights),
      reflected_(reflected),
      gather_(reflected_directions),
      channels_(channels),
      rays_(std::max(1, settings.rays_per_voxel)),
      face_points_(gaussRule(static_cast<int>(std::round(std::sqrt(static_cast<double>(rays_)))))),
      face_middle_(gaussRule(1)),
      shaped_(settings.want_shape),
      rescaled_(medium.rescaled()),
      ball_radius_(medium_.transform().meanVoxelSize() * std::cbrt(3 / (4 * M_PI))) {
  for (int c = 0; c < channels; ++c)
    thickest_ = std::max({thickest_, medium.optics(c).sigma_t_beam, medium.optics(c).true_sigma_t});
}

Gathered LightMarch::gather(size_t block, int n, bool all) const {
  Gathered sum;
  const Coord voxel = medium_.topology().origin(block) + voxelLocal(n);
  TwofoldDensity density;
  density.rho = medium_.density.values.block(block)[n];
  for (int c = 0; c < channels_; ++c) density.beam[c] = beams_.beamDensity(c).values.block(block)[n];
  const bool by_faces = thick(density.rho);
  const Vec3d centre = medium_.transform().toWorld(voxel.asVec3d());
  for (const PointSample& lamp : lights_.points) {
    const double distance = (centre - lamp.position).length();
    if (by_faces && distance >= kNearLamp * ball_radius_ && std::isfinite(distance))
      addThroughFaces(lamp, face_points_, voxel, density, sum);
    else
      addLamp(lamp, voxel.asVec3d(), Part{Vec3d(0), 1, density}, sum);
  }
  if (!all) return sum;
  for (const BeamSample& beam : lights_.beams)
    if (by_faces)
      addThroughFaces(beam, beam.count >= kManyBeams ? face_middle_ : face_points_, voxel, density, sum);
    else
      addBeam(beam, voxel, density, sum);
  for (const Vec3d& direction : gather_)
    if (by_faces)
      addThroughFaces(direction, face_middle_, voxel, density, sum);
    else if (const auto light = arrivalOf(direction, centre)) {
      const Vec3d p = voxel.asVec3d();
      const TwofoldPath path = twofold(density, [&](const Volume& met, float rho) {
        return lightPath(met, rho, p, p, light->toward, light->distance, beams_.enough());
      });
      addPart(*light, path, Part{Vec3d(0), 1, density}, sum);
    }
  return sum;
}

bool LightMarch::thick(float rho) const {
  return thickest_ * rho * medium_.transform().voxelSize().length() > kThickVoxel;
}

Vec3d LightMarch::wayOf(const PointSample& lamp, const Vec3d& p) const {
  return p - lamp.position;
}
Vec3d LightMarch::wayOf(const BeamSample& beam, const Vec3d&) const {
  return beam.direction;
}
Vec3d LightMarch::wayOf(const Vec3d& reflected_direction, const Vec3d&) const {
  return reflected_direction;
}

std::optional<LightMarch::Arrival> LightMarch::arrivalOf(const PointSample& lamp, const Vec3d& p) const {
  const Vec3d separation = lamp.position - p;
  const double r = separation.length();
  const Vec3d toward = separation / r;
  const double falloff = lamp.profile == PointSample::Profile::kIsotropic ? 1 : lamp.falloff(-toward);
  if (falloff <= 0 || (!occluder_.empty() && occluder_.hidden(p, toward, r))) return std::nullopt;
  const Vec3d power = lamp.intensity * (falloff * kInverseSphere / (r * r));
  return Arrival{power, power, toward, r};
}

std::optional<LightMarch::Arrival> LightMarch::arrivalOf(const BeamSample& beam, const Vec3d& p) const {
  const Vec3d toward = -beam.direction, power = beam.irradiance * kInverseSphere;
  if (!occluder_.empty() && occluder_.hidden(p, toward, kFar)) return std::nullopt;
  return Arrival{power, power, toward, kFar};
}

std::optional<LightMarch::Arrival> LightMarch::arrivalOf(const Vec3d& reflected_direction,
                                                         const Vec3d& p) const {
  const Vec3d toward = -reflected_direction;
  const auto hit = occluder_.closest(p, toward, kFar);
  if (!hit) return std::nullopt;
  const ReflectedLight::Radiance radiance = reflected_.radiance(*hit, p, toward);
  const double weight = 1.0 / static_cast<double>(gather_.size());
  return Arrival{radiance.direct * weight, radiance.beam * weight, toward, hit->distance};
}

template <typename Through>
TwofoldPath LightMarch::twofold(const LightPath& direct, const TwofoldDensity& density,
                                const Through& through) const {
  TwofoldPath path{direct, {direct, direct, direct}};
  const Volume* met = &medium_.density;
  for (int c = 0; c < channels_; ++c) {
    if (const Volume& own = beams_.beamDensity(c); &own != met) {
      met = &own;
      path.beam[c] = through(own, density.beam[c]);
    } else if (c > 0) {
      path.beam[c] = path.beam[c - 1];
    }
  }
  return path;
}

/// \param moments  moments(light, channel, lean, spread) adds those of light that has come by this path
template <typename Moments>
void LightMarch::add(const Arrival& light, const TwofoldPath& path, const Moments& moments,
                     Gathered& sum) const {
  const Vec3d axis = alongAxes(medium_.transform(), -light.toward);
  double basis[kSecondOrder];
  angularBasis(axis, basis);
  for (int c = 0; c < channels_; ++c) {
    const double sigma = beams_.optics(c).true_sigma_t, sigma_beam = beams_.optics(c).sigma_t_beam;
    const double direct =
        light.power[c] * beamAverage(sigma * path.direct.before, sigma * path.direct.inside);
    double scatters = direct;
    sum.direct[c] += direct;
    sum.direct_flux[c] += axis * direct;
    if (rescaled_) {
      scatters = light.power_beam[c] *
                 beamAverage(sigma_beam * path.beam[c].before, sigma_beam * path.beam[c].inside);
      sum.beam[c] += scatters;
      sum.beam_flux[c] += axis * scatters;
    }
    for (int k = kFirstOrder; k < kSecondOrder; ++k) sum.second[c][k - kFirstOrder] += scatters * basis[k];
    if (shaped_) moments(scatters, c, sum.lean[c], sum.spread[c]);
  }
}

void LightMarch::addPart(const Arrival& light, const TwofoldPath& path, const Part& part,
                         Gathered& sum) const {
  const Vec3d& size = medium_.transform().voxelSize();
  const Vec3d axis = alongAxes(medium_.transform(), -light.toward);
  add(
      light, path,
      [&](double scatters, int c, Vec3d& lean, Vec3d& spread) {
        // per unit of world length along an axis
        const double depth = beams_.optics(c).sigma_t_beam * part.density.beam[c] * part.side;
        for (int a = 0; a < 3; ++a) {
          const double x = part.offset[a], inner = part.side * beamLean(depth * axis[a] * size[a]);
          lean[a] += scatters * (x + inner);
          spread[a] += scatters * (x * (x + 2 * inner) + (part.side * part.side - 1) / 12);
        }
      },
      sum);
}

void LightMarch::addBeam(const BeamSample& beam, const Coord& voxel, const TwofoldDensity& density,
                         Gathered& sum) const {
  const Vec3d centre = voxel.asVec3d(), d = medium_.transform().directionToIndex(beam.direction);
  const double longest = std::max({std::abs(d[0]), std::abs(d[1]), std::abs(d[2])});
  int off_axis = 0;
  for (int a = 0; a < 3; ++a) off_axis += std::abs(d[a]) > 1e-9 * longest;
  const bool one_of_many = beam.count >= kManyBeams;
  const int rays = off_axis == 1 || one_of_many ? 1 : rays_;
  const int first = one_of_many ? beam.index : 0;
  for (int ray = 0; ray < rays; ++ray) {
    const Vec3d p =
        off_axis == 1 ? centre : centre + pointWithin(first + ray, one_of_many ? beam.count : rays);
    auto light = arrivalOf(beam, medium_.transform().toWorld(p));
    if (!light) continue;
    light->power /= rays;
    light->power_beam /= rays;
    const TwofoldPath path = twofold(density, [&](const Volume& met, float rho) {
      return lightPath(met, rho, p, centre, light->toward, kFar, beams_.enough());
    });
    addPart(*light, path, Part{Vec3d(0), 1, density}, sum);
  }
}

/// A lamp's light in a part of a voxel. Near the lamp the cube is cut into eight, as 1/r^2 and the shadow of
/// the medium change too much across it.
void LightMarch::addLamp(const PointSample& lamp, const Vec3d& voxel, const Part& part, Gathered& sum) const {
  const Vec3d p = voxel + part.offset;
  const double side = part.side;
  const Vec3d from = medium_.transform().toWorld(p), separation = lamp.position - from;
  const double r = separation.length(), radius = side * ball_radius_;
  const auto cut = [&] {
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3d offset(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
      addLamp(lamp, voxel, Part{part.offset + offset * (0.25 * side), 0.5 * side, part.density}, sum);
    }
  };
  if (side > kFinestCube && r < kNearLamp * radius) return cut();
  Vec3d toward(0);
  if (r > 1e-6 * radius) toward = separation / r;
  const double falloff = lamp.profile == PointSample::Profile::kIsotropic ? 1 : lamp.falloff(-toward);
  if (falloff <= 0) return;
  const bool beside = r > radius;
  if (beside && !occluder_.empty() && occluder_.hidden(from, toward, r)) return;
  const auto through = [&](const Volume& met, float rho) {
    LightPath path;
    path.inside = rho * radius;  // of a lamp that shines inside the cube: its light leaves from 0 to the rim
    if (!beside) return path;
    const Vec3d d = medium_.transform().directionToIndex(toward);
    const double half = side * exitOfVoxel(p, d, p);  // of the chord through the cube's centre
    path.inside = rho * (std::min(half, r) + half);
    path.before = columnDensity(met, p, d, half, r, beams_.enough());
    return path;
  };
  const LightPath direct = through(medium_.density, part.density.rho);
  if (beside) {
    // A thick cube shades itself, and one chord through its middle is not the mean of all.
    const double sigma_t = beams_.optics(0).true_sigma_t, depth = sigma_t * part.density.rho * 2 * radius;
    if (depth > kThickCube && side > kFinestThickCube && sigma_t * direct.before < kGoneBefore) return cut();
  }
  const Vec3d power =
      lamp.intensity * (falloff * meanInverseSquare(r, radius) * kInverseSphere * (side * side * side));
  addPart(Arrival{power, power, toward, r}, twofold(direct, part.density, through), part, sum);
}

/// A lamp's light falls off as its rays spread, so that along a chord neither tells.
template <typename Light>
void LightMarch::addThroughFaces(const Light& light, const Rule& rule, const Coord& voxel,
                                 const TwofoldDensity& density, Gathered& sum) const {
  const Transform& transform = medium_.transform();
  const Vec3d centre = voxel.asVec3d();
  const double far = wayOf(light, transform.toWorld(centre)).length();
  /// enters(p, d, weight): d per world length, weight the part of the face across it as seen from the light
  const auto forEachEntry = [&](const auto& enters) {
    forEachFacePoint(centre, rule, [&](const Vec3d& p, int a, int side, double area) {
      const Vec3d way = wayOf(light, transform.toWorld(p));
      const double r = way.length();
      const Vec3d d = transform.directionToIndex(way / r);
      if (d[a] * side < 0) enters(p, d, std::abs(d[a]) * area, far / r);
    });
  };
  // Of all parts together: the volume, 1 but for there being few, and the moments of even light.
  double volume = 0;
  Vec3d mean(0), square(0);
  forEachEntry([&](const Vec3d& p, const Vec3d& d, double across, double nearer) {
    const double chord = exitOfVoxel(p, d, centre), part = across * chord * nearer * nearer;
    const Vec3d x = p - centre, step = d * chord;
    volume += part;
    mean += part * (x + 0.5 * step);
    square += part * (x * x + x * step + step * step / 3.0);
  });
  if (!(volume > 0)) return;
  mean /= volume;
  square /= volume;
  Gathered gathered;
  forEachEntry([&](const Vec3d& p, const Vec3d& d, double across, double) {
    auto arrival = arrivalOf(light, transform.toWorld(p));
    if (!arrival) return;
    const double whole = exitOfVoxel(p, d, centre), chord = whole / volume;
    const Vec3d x = p - centre, step = d * whole;
    arrival->power *= across * chord;
    arrival->power_beam *= across * chord;
    const TwofoldPath path = twofold(density, [&](const Volume& met, float rho) {
      LightPath one;
      one.inside = rho * chord;
      one.before = columnDensity(met, p, -d, 0, arrival->distance, beams_.enough());
      return one;
    });
    add(
        *arrival, path,
        [&](double scatters, int c, Vec3d& lean, Vec3d& spread) {
          const DecayMoments decay = decayMoments(beams_.optics(c).sigma_t_beam * path.beam[c].inside);
          const double first = decay.m1 / decay.m0, second = decay.m2 / decay.m0;
          lean += scatters * (x + first * step - mean);
          spread += scatters * (x * x + (2 * first) * x * step + second * step * step - square);
        },
        gathered);
  });
  if (shaped_) placeBesideFaces(wayOf(light, transform.toWorld(centre)).unit(), voxel, density, gathered);
  sum += gathered;
}

/// Moments in the thickest voxels are those of beam_faces.h.
void LightMarch::placeBesideFaces(const Vec3d& direction, const Coord& voxel, const TwofoldDensity& density,
                                  Gathered& sum) const {
  const Transform& transform = medium_.transform();
  const double h = transform.meanVoxelSize();
  const Vec3d s = alongAxes(transform, direction);
  for (int c = 0; c < channels_; ++c) {
    const BeamFaces faces(s, transform.voxelSize() / h, beams_.optics(c).sigma_t_beam * h);
    const float rho = density.beam[c];
    if (!faces.any(rho)) continue;
    const double share = faces.share(rho), placed = share * (rescaled_ ? sum.beam[c] : sum.direct[c]);
    Row before[3];
    for (int a = 0; a < 3; ++a) {
      Coord from = voxel;
      from[a] += faces.fromAbove(a) ? 1 : -1;
      before[a] = Row{} + beams_.beamDensity(c).values.at(medium_.topology(), from);
    }
    const BeamFaces::Moments moments = faces.moments(Row{} + rho, before);
    for (int a = 0; a < 3; ++a) {
      sum.lean[c][a] += placed * moments.lean[a][0] - share * sum.lean[c][a];
      sum.spread[c][a] += placed * moments.spread[a][0] - share * sum.spread[c][a];
    }
  }
}

}  // namespace vdb_diffuse
