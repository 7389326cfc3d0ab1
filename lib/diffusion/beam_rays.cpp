#include "diffusion/beam_rays.h"

#include <algorithm>
#include <cmath>

#include "diffusion/beam_faces.h"
#include "diffusion/source_shape.h"
#include "grid/parallel.h"
#include "grid/ray_march.h"
#include "medium/angular_basis.h"
#include "medium/transmittance.h"

namespace vdb_diffuse {
namespace {

constexpr int kTile = 8;  // lattice tiles, in voxels: more than two, the width that rays of one voxel span
constexpr double kGone = 1e-17;  // transmittance below which light is beyond any float beside the rest

/// A lattice in index space. It hangs on the middle of the active voxels, so that a volume that is moved or
/// mirrored is lit the same.
struct Lattice {
  int u, v, w;  // axes
  Vec3d d;      // direction in index space, |d[w]| = 1
  Beam beam;
  Vec3d anchor;   // the middle of the active voxels; a voxel's centre for a beam along the axis
  double length;  // world length per unit of t
  int rays() const { return beam.rays; }  // per voxel and axis
  Vec3d start(int64_t i, int64_t j) const {
    const auto cell = [&](int64_t n) { return static_cast<int64_t>(std::floor(double(n) / rays())); };
    const int64_t in_cell_u = i - cell(i) * rays(), in_cell_v = j - cell(j) * rays();
    const std::array<double, 2> place =
        placeOfRay(beam, static_cast<int>(in_cell_u), static_cast<int>(in_cell_v));
    Vec3d p = anchor;
    p[u] += static_cast<double>(cell(i)) + place[0];
    p[v] += static_cast<double>(cell(j)) + place[1];
    return p;
  }
};

Lattice latticeOf(const Beam& beam, const Transform& transform, const Vec3d& middle) {
  Lattice lattice;
  Vec3d d = transform.directionToIndex(beam.direction);
  lattice.w = 0;
  for (int a = 1; a < 3; ++a)
    if (std::abs(d[a]) > std::abs(d[lattice.w])) lattice.w = a;
  lattice.u = (lattice.w + 1) % 3;
  lattice.v = (lattice.w + 2) % 3;
  d /= std::abs(d[lattice.w]);
  for (int a = 0; a < 3; ++a)
    if (std::abs(d[a]) < 1e-12) d[a] = 0;
  lattice.d = d;
  lattice.length = transform.directionToWorld(d).length();
  const bool along_axis = d[lattice.u] == 0 && d[lattice.v] == 0;
  lattice.anchor = middle;
  for (int a : {lattice.u, lattice.v}) lattice.anchor[a] += asideOf(d[a]);
  if (along_axis)
    for (int a = 0; a < 3; ++a) lattice.anchor[a] = std::floor(middle[a]);
  lattice.beam = beam;
  if (along_axis) {
    lattice.beam.rays = 1;
    lattice.beam.shift[0] = lattice.beam.shift[1] = 0.5;
  }
  return lattice;
}

/// Where in a voxel of each layer the lattice's rays run on average, in voxels from its centre. All voxels of
/// a layer meet the same rays, and a beam that they find even must have no moments.
class LayerMoments {
 public:
  struct Layer {
    double centre[3], square[3];  ///< means of x and x^2 over the rays in a voxel, by axis
    double stretch[3];            ///< of moments: few rays side by side cover less than the voxel
  };

  LayerMoments(const Lattice& lattice, int lowest, int highest) : lattice_(lattice), first_(lowest) {
    constexpr int64_t kMostKept = 1 << 16;  // pieces of a volume may lie any distance apart
    if (int64_t{highest} - lowest >= kMostKept) return;
    for (int layer = lowest; layer <= highest; ++layer) layers_.push_back(layerAt(lattice, layer));
  }
  Layer at(int layer) const { return layers_.empty() ? layerAt(lattice_, layer) : layers_[layer - first_]; }

 private:
  const Lattice& lattice_;
  int first_;
  std::vector<Layer> layers_;

  static Layer layerAt(const Lattice& lattice, int layer) {
    constexpr double kMostStretch = 4;
    const int places = lattice.rays() * lattice.rays();
    Layer moments{};
    moments.square[lattice.w] = 1. / 12;
    moments.stretch[lattice.w] = 1;
    for (int axis : {lattice.u, lattice.v}) {
      // The middle of the rays in a voxel is a sawtooth of the height, one tooth for each ray's distance.
      const double slope = lattice.d[axis] / lattice.d[lattice.w], spacing = 1.0 / places;
      const double at = lattice.start(0, 0)[axis] + slope * (layer - 0.5 - lattice.anchor[lattice.w]);
      const auto saw = [&](double x) {
        const double y = x - (places % 2 == 1 ? 0 : 0.5 * spacing);
        return y - spacing * std::floor(y / spacing + 0.5);
      };
      double centre, square;
      if (std::abs(slope) < 1e-6) {
        const double s = saw(at);
        centre = s;
        square = s * s;
      } else {
        // integrals of saw and saw^2 over the layer, the teeth counted
        const double a = saw(at), b = saw(at + slope);
        const double teeth = std::round((at + slope - b - (at - a)) / spacing);
        centre = (b * b - a * a) / (2 * slope);
        square = ((b * b * b - a * a * a) / 3 + teeth * spacing * spacing * spacing / 12) / slope;
      }
      moments.centre[axis] = centre;
      moments.square[axis] = square + (1 - spacing * spacing) / 12;
      const double variance = moments.square[axis] - centre * centre;
      moments.stretch[axis] = std::min(1. / 12 / variance, kMostStretch);
    }
    return moments;
  }
};

/// The tiles of the lattice that some block's shadow touches, in four lists by the parity of their place.
std::array<std::vector<std::pair<int32_t, int32_t>>, 4> tilesOf(const Topology& topology,
                                                                const Lattice& lattice) {
  std::vector<std::pair<int32_t, int32_t>> all;
  const double slope_u = lattice.d[lattice.u] / lattice.d[lattice.w],
               slope_v = lattice.d[lattice.v] / lattice.d[lattice.w];
  const auto range = [&](const Coord& origin, int axis, double slope, int32_t& first, int32_t& last) {
    const double low = origin[lattice.w] - 0.5 - lattice.anchor[lattice.w], high = low + kBlockWidth;
    const double side = origin[axis] - 0.5 - lattice.anchor[axis];
    const double a = side - std::max(slope * low, slope * high);
    const double b = side + kBlockWidth - std::min(slope * low, slope * high);
    first = static_cast<int32_t>(std::floor((a + 0.5) / kTile));
    last = static_cast<int32_t>(std::floor((b + 0.5) / kTile));
  };
  for (size_t b = 0; b < topology.blockCount(); ++b) {
    int32_t u0, u1, v0, v1;
    range(topology.origin(b), lattice.u, slope_u, u0, u1);
    range(topology.origin(b), lattice.v, slope_v, v0, v1);
    for (int32_t i = u0; i <= u1; ++i)
      for (int32_t j = v0; j <= v1; ++j) all.emplace_back(i, j);
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  std::array<std::vector<std::pair<int32_t, int32_t>>, 4> tiles;
  for (const auto& tile : all) tiles[(tile.first & 1) * 2 + (tile.second & 1)].push_back(tile);
  return tiles;
}

/// Light of one ray: what is left of it and what it deposits, by channel, for the true and the rescaled
/// medium.
struct RayLight {
  double direct[3], beam[3];
  double largest(int channels) const {
    double m = 0;
    for (int c = 0; c < channels; ++c) m = std::max({m, direct[c], beam[c]});
    return m;
  }
};

/// A place along a ray where surfaces change the light to `radiance`.
struct Change {
  double t;
  ReflectedLight::Radiance power;
};

/// (1 - exp(-tau)) / tau; the series' first term left out is below 1e-9.
double meanTransmittance(double tau) {
  if (tau > 0.2) return -std::expm1(-tau) / tau;
  return 1 -
         tau * (1. / 2 -
                tau * (1. / 6 - tau * (1. / 24 - tau * (1. / 120 - tau * (1. / 720 - tau * (1. / 5040))))));
}

}  // namespace

BeamRays::BeamRays(const BeamMedium& medium, int channels, const Occluder& occluder,
                   const ReflectedLight& reflected)
    : beams_(medium),
      medium_(medium.medium()),
      channels_(channels),
      occluder_(occluder),
      reflected_(reflected) {
  const Topology& topology = medium_.topology();
  if (topology.blockCount() == 0) return;
  const auto [lowest, highest] = topology.activeBox();
  middle_index_ = 0.5 * (lowest.asVec3d() + highest.asVec3d());
  Vec3d low(1e300), high(-1e300);
  const Coord &a = topology.lowest(), &b = topology.highest();
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d p =
        medium_.transform().toWorld(Vec3d(corner & 1 ? b[0] + 1 : a[0] - 1, corner & 2 ? b[1] + 1 : a[1] - 1,
                                          corner & 4 ? b[2] + 1 : a[2] - 1));
    low = openvdb::math::minComponent(low, p);
    high = openvdb::math::maxComponent(high, p);
  }
  width_ = (high - low).length();
  surfaces_inside_ = occluder.comesNear(low, high);
}

void BeamRays::add(const Beam& beam, FirstScatter& sum) const {
  const Topology& topology = medium_.topology();
  const Transform& transform = medium_.transform();
  const Lattice lattice = latticeOf(beam, transform, middle_index_);
  const int channels = channels_;
  const bool rescaled = !sum.beam.empty();
  const LayerMoments layers(lattice, topology.lowest()[lattice.w], topology.highest()[lattice.w]);
  const double share = 1.0 / (lattice.rays() * lattice.rays());
  Vec3d along_axes;
  for (int a = 0; a < 3; ++a)
    along_axes[a] = beam.direction.dot(transform.axis(a)) / transform.axis(a).length();
  double basis[kSecondOrder];
  angularBasis(along_axes, basis);
  std::vector<BeamFaces> faces;      // by channel
  std::vector<Field<float>> beside;  // what scatters beside them
  for (size_t c = 0; c < sum.shape.size(); ++c) {
    faces.emplace_back(along_axes, transform.voxelSize() / transform.meanVoxelSize(),
                       beams_.optics(static_cast<int>(c)).sigma_t_beam * transform.meanVoxelSize());
    beside.emplace_back(topology);
  }

  // Where surfaces change the light of a ray from t_first on, in order; t counts from p. What it met before
  // is asked backward: the nearest surface there is all that counts.
  const auto changesOf = [&](const Vec3d& p, double t_first, std::vector<Change>& changes) {
    changes.clear();
    Vec3d origin = transform.toWorld(p + lattice.d * t_first);
    constexpr double kFar = std::numeric_limits<double>::infinity();
    const auto add = [&](double t, const Occluder::Hit& hit, const Vec3d& from, const Vec3d& toward) {
      Change change{t, reflected_.radiance(hit, from, toward)};
      change.power.direct *= beam.weight;
      change.power.beam *= beam.weight;
      changes.push_back(change);
    };
    if (!beam.from_surfaces) {
      if (occluder_.hidden(origin, -beam.direction, kFar)) changes.push_back({t_first, {}});
    } else if (const auto hit = occluder_.closest(origin, -beam.direction, kFar)) {
      add(t_first, *hit, origin, -beam.direction);
    }
    if (!surfaces_inside_ || (!beam.from_surfaces && !changes.empty())) return;
    double travelled = 0;
    const double least_step = 1e-6 * transform.meanVoxelSize() + 1e-9 * width_;
    double step = least_step;
    std::pair<int, uint32_t> last(-1, 0);
    while (auto hit = occluder_.closest(origin, beam.direction, width_ - travelled)) {
      const double t = t_first + (travelled + hit->distance) / lattice.length;
      if (!beam.from_surfaces) {
        changes.push_back({t, {}});
        return;  // dark from here on
      }
      // Of surfaces that reach far beyond the volume, floats hold the place so coarsely that a ray meets the
      // same triangle over and over.
      const std::pair<int, uint32_t> met(hit->surface, hit->triangle);
      step = met == last ? 2 * step : least_step;
      last = met;
      hit->front = !hit->front;  // light goes on from the side that a forward ray does not meet
      add(t, *hit, origin, beam.direction);
      travelled += hit->distance + step;
      if (!(travelled < width_)) return;
      origin += beam.direction * (hit->distance + step);
    }
  };

  const auto followRay = [&](const Vec3d& p, std::vector<Change>& changes) {
    RayLight light;
    const auto set = [&](const ReflectedLight::Radiance& power) {
      for (int c = 0; c < channels; ++c) {
        light.direct[c] = power.direct[c] * share;
        light.beam[c] = power.beam[c] * share;
      }
    };
    set({beam.power, beam.power});
    bool asked = occluder_.empty();
    changes.clear();
    size_t next = 0;
    double brightest = light.largest(channels);
    const auto addShape = [&](BeamShape& shape, size_t block, int voxel, double t0, double extent,
                              double light, const DecayMoments& decay) {
      const Coord at = topology.origin(block) + voxelLocal(voxel);
      const LayerMoments::Layer layer = layers.at(at[lattice.w]);
      const double first = decay.m1 / decay.m0, second = decay.m2 / decay.m0;
      for (int a = 0; a < 3; ++a) {
        const double x = p[a] + t0 * lattice.d[a] - at[a], step = extent * lattice.d[a];
        const double mean = x + step * first, square = x * (x + 2 * step * first) + step * step * second;
        shape.lean[a].block(block)[voxel] +=
            static_cast<float>(light * layer.stretch[a] * (mean - layer.centre[a]));
        shape.spread[a].block(block)[voxel] += static_cast<float>(light * (square - layer.square[a]));
      }
    };
    const auto deposit = [&](size_t block, int voxel, double t0, double t1) {
      const double extent = t1 - t0,
                   column = medium_.density.values.block(block)[voxel] * extent * lattice.length;
      for (int c = 0; c < channels; ++c) {
        const double tau = beams_.optics(c).true_sigma_t * column, mean = meanTransmittance(tau);
        const double direct = light.direct[c] * mean * extent;
        light.direct[c] *= 1 - tau * mean;
        sum.direct[c].block(block)[voxel] += static_cast<float>(direct);
        double scatters = direct, tau_scatters = tau;
        if (rescaled) {
          const float rho = beams_.beamDensity(c).values.block(block)[voxel];
          tau_scatters = beams_.optics(c).sigma_t_beam * (rho * extent * lattice.length);
          const double mean_beam = meanTransmittance(tau_scatters);
          scatters = light.beam[c] * mean_beam * extent;
          light.beam[c] *= 1 - tau_scatters * mean_beam;
          sum.beam[c].block(block)[voxel] += static_cast<float>(scatters);
        }
        if (!sum.shape.empty()) {
          const double placed = scatters * faces[c].share(beams_.beamDensity(c).values.block(block)[voxel]);
          beside[c].block(block)[voxel] += static_cast<float>(placed);
          addShape(sum.shape[c], block, voxel, t0, extent, scatters - placed, decayMoments(tau_scatters));
        }
        if (!sum.beam_flux.empty())
          for (int a = 0; a < 3; ++a)
            sum.beam_flux[c][a].block(block)[voxel] += static_cast<float>(scatters * along_axes[a]);
        if (!sum.second_moments.empty())
          for (int k = kFirstOrder; k < kSecondOrder; ++k)
            sum.second_moments[c][k - kFirstOrder].block(block)[voxel] +=
                static_cast<float>(scatters * basis[k]);
        if (!sum.direct_flux.empty())
          for (int a = 0; a < 3; ++a)
            sum.direct_flux[c][a].block(block)[voxel] += static_cast<float>(direct * along_axes[a]);
      }
    };
    constexpr double kFar = std::numeric_limits<double>::infinity();
    marchRay(topology, p, lattice.d, -kFar, kFar, [&](size_t block, int voxel, double t0, double t1) {
      const bool active = topology.active(block).isOn(voxel);
      if (!asked) {
        if (!active) return true;
        changesOf(p, t0, changes);
        asked = true;
        if (beam.from_surfaces && changes.empty()) return false;
      }
      while (next < changes.size() && changes[next].t < t1) {
        const double t = std::max(t0, changes[next].t);
        if (active && t > t0) deposit(block, voxel, t0, t);
        set(changes[next].power);
        brightest = std::max(brightest, light.largest(channels));
        t0 = t;
        ++next;
      }
      if (active) deposit(block, voxel, t0, t1);
      return next < changes.size() || light.largest(channels) > kGone * brightest;
    });
  };

  const auto tiles = tilesOf(topology, lattice);
  const int rays = kTile * lattice.rays();
  for (const auto& colour : tiles)
    forEachBlock(
        colour.size(),
        [&](size_t tile) {
          std::vector<Change> changes;
          for (int64_t i = int64_t{colour[tile].first} * rays; i < (int64_t{colour[tile].first} + 1) * rays;
               ++i)
            for (int64_t j = int64_t{colour[tile].second} * rays;
                 j < (int64_t{colour[tile].second} + 1) * rays; ++j)
              followRay(lattice.start(i, j), changes);
        },
        1);
  for (size_t c = 0; c < sum.shape.size(); ++c)
    forEachBlock(topology.blockCount(), [&](size_t b) {
      Halo<float> rho;
      loadHalo(topology, beams_.beamDensity(static_cast<int>(c)).values, b, 0.0f, rho);
      BlockMoments moments{beside[c].block(b), {}, {}};
      for (int a = 0; a < 3; ++a) {
        moments.lean[a] = sum.shape[c].lean[a].block(b);
        moments.spread[a] = sum.shape[c].spread[a].block(b);
      }
      addMoments(faces[c], rho, moments);
    });
}

}  // namespace vdb_diffuse
