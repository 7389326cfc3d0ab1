#include "diffusion/first_scatter.h"

#include <atomic>
#include <cmath>

#include "diffusion/beam_sweep.h"
#include "diffusion/light_path.h"
#include "diffusion/reflected_light.h"
#include "diffusion/source_shape.h"
#include "medium/angular_basis.h"
#include "scene/colour.h"

namespace vdb_diffuse {
namespace {

constexpr double kInverseSphere = 1 / (4 * M_PI);
/// A cube nearer to a lamp than this many of its radii is cut into eight, down to the finest side in voxels.
constexpr double kNearLamp = 4, kFinestCube = 1.0 / 64;

/// A cube of more optical depths is cut as well, down to this side, unless the light is gone before it.
constexpr double kThickCube = 1, kFinestThickCube = 0.25, kGoneBefore = 6;

Vec3d beamExtinction(const Medium& medium, Model model, int phase_order) {
  Vec3d sigma;
  for (int c = 0; c < 3; ++c) sigma[c] = channelOptics(medium.optics, c, model, phase_order).sigma_t_beam;
  return sigma;
}

/// From so many beams on, as a dome has, they average among themselves and each takes one ray per voxel.
constexpr int kManyBeams = 16;

/// Points of the unit square or cube, spread evenly by the generalised golden ratio of `dimensions`;
/// -1/2..1/2.
double spreadPoint(int n, int axis, int dimensions) {
  const double phi = dimensions == 2 ? 1.32471795724474602596 : 1.22074408460575947536;
  const double u = (n + 0.5) / std::pow(phi, axis + 1);
  return u - std::floor(u + 0.5);
}

/// What one voxel has gathered: per channel the mean over directions and the vector mean, for the true and
/// for the rescaled attenuation.
struct Gathered {
  double direct[3] = {}, beam[3] = {};
  Vec3d direct_flux[3], beam_flux[3];
  double second[3][kSecondOrder - kFirstOrder] = {};
  Vec3d lean[3], spread[3];  // of the rescaled light, see BeamShape
};

/// A part of a voxel, a cube, that light passes as if all beside it were like it.
struct Part {
  Vec3d offset{0, 0, 0};  ///< of its centre from the voxel's, in voxels
  double side = 1;        ///< in voxels
  float rho = 0;
};

class Gatherer {
 public:
  Gatherer(const Medium& medium, const Scene& scene, const Occluder& occluder, Model model,
           const FirstScatterSettings& settings)
      : medium_(medium),
        occluder_(occluder),
        lights_(sampleLights(scene, settings.lights)),
        reflected_(medium, beamExtinction(medium, model, settings.phase_order), lights_, scene.surfaces,
                   occluder),
        gather_(reflected_.any() ? sphereDirections(settings.gather_directions) : std::vector<Vec3d>()),
        channels_(medium.grey() && greyScene(scene) ? 1 : 3),
        rays_(std::max(1, settings.rays_per_voxel)),
        shaped_(settings.want_shape),
        ball_radius_(medium.transform().meanVoxelSize() * std::cbrt(3 / (4 * M_PI))) {
    double thinnest = std::numeric_limits<double>::infinity();
    for (int c = 0; c < channels_; ++c) {
      optics_[c] = channelOptics(medium.optics, c, model, settings.phase_order);
      thinnest = std::min({thinnest, optics_[c].sigma_t_beam, optics_[c].true_sigma_t});
    }
    enough_ = kOpaque / thinnest;
    rescaled_ = optics_[0].rescaled() || optics_[channels_ - 1].rescaled();
  }

  int channels() const { return channels_; }
  bool rescaled() const { return rescaled_; }
  bool anisotropic() const { return optics_[0].g != 0; }
  bool secondOrder() const { return optics_[0].p2 != 0; }

  bool hasPoints() const { return !lights_.points.empty(); }

  /// Marches from a voxel to the lights: to all of them, or only to those at a finite distance.
  void gather(const Coord& voxel, float rho, bool all, Gathered& sum) const {
    for (const PointSample& point : lights_.points)
      addPoint(point, voxel.asVec3d(), Part{Vec3d(0), 1, rho}, sum);
    if (!all) return;
    for (const BeamSample& beam : lights_.beams) addBeam(beam, voxel, rho, sum);
    for (const Vec3d& direction : gather_) addReflected(direction, voxel, rho, sum);
  }

  /// Sweeps along all beams, and along the directions of reflected light.
  void sweep(FirstScatter& sum, const Progress& progress) const {
    const std::vector<ChannelOptics> optics(optics_, optics_ + channels_);
    std::vector<Beam> beams;
    const auto oneOfMany = [](Beam& beam, int index) {
      for (int a = 0; a < 2; ++a) beam.shift[a] = 0.5 + spreadPoint(index, a, 2);
    };
    for (const BeamSample& sample : lights_.beams) {
      Beam beam;
      beam.direction = sample.direction;
      beam.power = sample.irradiance * kInverseSphere;
      if (sample.count >= kManyBeams)
        oneOfMany(beam, sample.index);
      else
        beam.rays = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(rays_))));
      beams.push_back(beam);
    }
    for (size_t n = 0; n < gather_.size(); ++n) {
      Beam beam;
      beam.direction = gather_[n];
      beam.from_surfaces = true;
      beam.weight = 1.0 / static_cast<double>(gather_.size());
      oneOfMany(beam, static_cast<int>(n));
      beams.push_back(beam);
    }
    BeamSweep(medium_, optics, occluder_, reflected_).add(beams, sum, progress);
  }

 private:
  const Medium& medium_;
  const Occluder& occluder_;
  LightSamples lights_;
  ReflectedLight reflected_;
  std::vector<Vec3d> gather_;
  int channels_, rays_;
  bool shaped_;
  double ball_radius_, enough_ = 0;
  bool rescaled_ = false;
  ChannelOptics optics_[3];

  /// Adds light of mean intensity `power` (before attenuation) that travels along `direction` through a part
  /// of a voxel.
  void add(const Vec3d& power, const Vec3d& direction, const LightPath& path, const Part& part,
           Gathered& sum) const {
    add(power, power, direction, path, part, sum);
  }
  /// \param power_beam  the same in the rescaled medium
  void add(const Vec3d& power, const Vec3d& power_beam, const Vec3d& direction, const LightPath& path,
           const Part& part, Gathered& sum) const {
    Vec3d axis;
    for (int a = 0; a < 3; ++a)
      axis[a] = direction.dot(medium_.transform().axis(a)) / medium_.transform().axis(a).length();
    double basis[kSecondOrder];
    angularBasis(axis, basis);
    for (int c = 0; c < channels_; ++c) {
      const double sigma = optics_[c].true_sigma_t;
      const double direct = power[c] * beamAverage(sigma * path.before, sigma * path.inside);
      sum.direct[c] += direct;
      sum.direct_flux[c] += axis * direct;
      const auto addMoments = [&](double light, double extinction) {
        for (int k = kFirstOrder; k < kSecondOrder; ++k) sum.second[c][k - kFirstOrder] += light * basis[k];
        if (!shaped_) return;
        const double depth = extinction * part.rho * part.side;  // per unit of world length along an axis
        for (int a = 0; a < 3; ++a) {
          const double lean = part.side * beamLean(depth * axis[a] * medium_.transform().voxelSize()[a]);
          const double x = part.offset[a];
          sum.lean[c][a] += light * (x + lean);
          sum.spread[c][a] += light * (x * (x + 2 * lean) + (part.side * part.side - 1) / 12);
        }
      };
      if (!rescaled_) {
        addMoments(direct, sigma);
        continue;
      }
      const double sigma_beam = optics_[c].sigma_t_beam;
      const double beam = power_beam[c] * beamAverage(sigma_beam * path.before, sigma_beam * path.inside);
      sum.beam[c] += beam;
      sum.beam_flux[c] += axis * beam;
      addMoments(beam, sigma_beam);
    }
  }

  /// Points of a voxel relative to its centre. They come in opposite pairs: were their mean not the centre,
  /// every voxel would see the beam too early or too late.
  static Vec3d offset(int ray, int rays) {
    if (ray == rays - 1 && rays % 2 == 1) return Vec3d(0);
    const Vec3d u(spreadPoint(ray / 2, 0, 3), spreadPoint(ray / 2, 1, 3), spreadPoint(ray / 2, 2, 3));
    return ray % 2 ? -u : u;
  }

  void addBeam(const BeamSample& beam, const Coord& voxel, float rho, Gathered& sum) const {
    const Vec3d centre = voxel.asVec3d(), toward = -beam.direction;
    const Vec3d d = medium_.transform().directionToIndex(toward);
    const double longest = std::max({std::abs(d[0]), std::abs(d[1]), std::abs(d[2])});
    int off_axis = 0;
    for (int a = 0; a < 3; ++a) off_axis += std::abs(d[a]) > 1e-9 * longest;
    const bool one_of_many = beam.count >= kManyBeams;
    const int rays = off_axis == 1 || one_of_many ? 1 : rays_;
    const int first = one_of_many ? beam.index : 0;
    for (int ray = 0; ray < rays; ++ray) {
      const Vec3d p = off_axis == 1 ? centre : centre + offset(first + ray, one_of_many ? beam.count : rays);
      constexpr double kFar = std::numeric_limits<double>::infinity();
      if (!occluder_.empty() && occluder_.hidden(medium_.transform().toWorld(p), toward, kFar)) continue;
      add(beam.irradiance * (kInverseSphere / rays), beam.direction,
          lightPath(medium_.density, rho, p, centre, toward, kFar, enough_), Part{Vec3d(0), 1, rho}, sum);
    }
  }

  /// A lamp's light in a part of a voxel. Near the lamp the cube is cut into eight, as 1/r^2 and the shadow
  /// of the medium change too much across it.
  void addPoint(const PointSample& point, const Vec3d& voxel, const Part& part, Gathered& sum) const {
    const Vec3d p = voxel + part.offset;
    const double side = part.side;
    const float rho = part.rho;
    const Vec3d from = medium_.transform().toWorld(p), separation = point.position - from;
    const double r = separation.length(), radius = side * ball_radius_;
    const auto cut = [&] {
      for (int corner = 0; corner < 8; ++corner) {
        const Vec3d offset(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
        addPoint(point, voxel, Part{part.offset + offset * (0.25 * side), 0.5 * side, rho}, sum);
      }
    };
    if (side > kFinestCube && r < kNearLamp * radius) return cut();
    LightPath path;
    Vec3d toward(0);
    if (r > 1e-6 * radius) toward = separation / r;
    const double falloff = point.profile == PointSample::Profile::kIsotropic ? 1 : point.falloff(-toward);
    if (falloff <= 0) return;
    if (r > radius) {
      if (!occluder_.empty() && occluder_.hidden(from, toward, r)) return;
      const Vec3d d = medium_.transform().directionToIndex(toward);
      const double half = side * exitOfVoxel(p, d, p);  // of the chord through the cube's centre
      path.inside = rho * (std::min(half, r) + half);
      path.before = columnDensity(medium_.density, p, d, half, r, enough_);
      // A thick cube shades itself, and one chord through its middle is not the mean of all.
      const double sigma_t = optics_[0].true_sigma_t, depth = sigma_t * rho * 2 * radius;
      if (depth > kThickCube && side > kFinestThickCube && sigma_t * path.before < kGoneBefore) return cut();
    } else {
      path.inside = rho * radius;  // the lamp shines inside the cube: its light leaves from 0 to the rim
    }
    const double spread = falloff * meanInverseSquare(r, radius) * kInverseSphere * (side * side * side);
    add(point.intensity * spread, -toward, path, part, sum);
  }

  void addReflected(const Vec3d& direction, const Coord& voxel, float rho, Gathered& sum) const {
    const Vec3d centre = voxel.asVec3d(), from = medium_.transform().toWorld(centre), toward = -direction;
    const auto hit = occluder_.closest(from, toward, std::numeric_limits<double>::infinity());
    if (!hit) return;
    const ReflectedLight::Radiance radiance = reflected_.radiance(*hit, from, toward);
    const double weight = 1.0 / static_cast<double>(gather_.size());
    add(radiance.direct * weight, radiance.beam * weight, direction,
        lightPath(medium_.density, rho, centre, centre, toward, hit->distance, enough_),
        Part{Vec3d(0), 1, rho}, sum);
  }
};

}  // namespace

FirstScatter firstScatter(const Medium& medium, const Scene& scene, const Occluder& occluder, Model model,
                          const FirstScatterSettings& settings) {
  const Gatherer gatherer(medium, scene, occluder, model, settings);
  const Topology& topology = medium.topology();
  const size_t channels = static_cast<size_t>(gatherer.channels());
  FirstScatter result;
  const auto vectorFields = [&] {
    std::vector<VectorField> fields(channels);
    for (VectorField& field : fields)
      for (Field<float>& component : field) component = Field<float>(topology);
    return fields;
  };
  for (size_t c = 0; c < channels; ++c) {
    result.direct.emplace_back(topology);
    if (gatherer.rescaled()) result.beam.emplace_back(topology);
  }
  if (gatherer.anisotropic() || settings.want_flux) result.beam_flux = vectorFields();
  if (gatherer.rescaled() && settings.want_flux) result.direct_flux = vectorFields();

  if (settings.want_shape) {
    const std::vector<VectorField> lean = vectorFields(), spread = lean;
    for (size_t c = 0; c < channels; ++c) result.shape.push_back({lean[c], spread[c]});
  }
  if (gatherer.secondOrder())
    for (size_t c = 0; c < channels; ++c) {
      result.second_moments.emplace_back();
      for (int k = kFirstOrder; k < kSecondOrder; ++k) result.second_moments[c].emplace_back(topology);
    }

  if (topology.blockCount() == 0) return result;
  if (!settings.exact_march) gatherer.sweep(result, settings.progress);
  if (!settings.exact_march && !gatherer.hasPoints()) return result;

  std::atomic<size_t> done{0};
  const auto add = [](std::vector<VectorField>& fields, const Vec3d* flux, size_t b, int voxel) {
    for (size_t c = 0; c < fields.size(); ++c)
      for (int a = 0; a < 3; ++a) fields[c][a].block(b)[voxel] += static_cast<float>(flux[c][a]);
  };
  forEachBlock(topology.blockCount(), [&](size_t b) {
    const BlockMask& voxels = settings.only ? (*settings.only)[b] : topology.active(b);
    for (auto it = voxels.beginOn(); it; ++it) {
      const int voxel = static_cast<int>(it.pos());
      Gathered sum;
      for (int c = 0; c < 3; ++c)
        sum.direct_flux[c] = sum.beam_flux[c] = sum.lean[c] = sum.spread[c] = Vec3d(0);
      gatherer.gather(topology.origin(b) + voxelLocal(voxel), medium.density.values.block(b)[voxel],
                      settings.exact_march, sum);
      for (size_t c = 0; c < channels; ++c) {
        result.direct[c].block(b)[voxel] += static_cast<float>(sum.direct[c]);
        if (!result.beam.empty()) result.beam[c].block(b)[voxel] += static_cast<float>(sum.beam[c]);
      }
      add(result.beam_flux, gatherer.rescaled() ? sum.beam_flux : sum.direct_flux, b, voxel);
      add(result.direct_flux, sum.direct_flux, b, voxel);
      for (size_t c = 0; c < result.shape.size(); ++c)
        for (int a = 0; a < 3; ++a) {
          result.shape[c].lean[a].block(b)[voxel] += static_cast<float>(sum.lean[c][a]);
          result.shape[c].spread[a].block(b)[voxel] += static_cast<float>(sum.spread[c][a]);
        }
      for (size_t c = 0; c < result.second_moments.size(); ++c)
        for (int k = 0; k < kSecondOrder - kFirstOrder; ++k)
          result.second_moments[c][k].block(b)[voxel] += static_cast<float>(sum.second[c][k]);
    }
    const size_t finished = ++done;
    if (settings.progress && finished % 64 == 0)
      settings.progress("source", static_cast<double>(finished) / topology.blockCount());
  });
  return result;
}

}  // namespace vdb_diffuse
