#include "diffusion/beam_sweep.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>

#include "diffusion/beam_faces.h"
#include "diffusion/beam_pass.h"
#include "grid/parallel.h"
#include "medium/angular_basis.h"
#include "medium/turned_block.h"
#include "medium/wavefront.h"

namespace vdb_diffuse {
namespace {

/// Channels whose light is weakened alike, in the medium as it is or in the rescaled one.
struct Lane {
  double extinction;            // optical depth of a voxel of mean size per density
  const Field<float>* density;  // that it is of
  bool rescaled;
  std::vector<int> channels;
};

std::vector<Lane> lanesOf(const BeamMedium& medium, int channels, bool rescaled, bool shared) {
  const double h = medium.medium().transform().meanVoxelSize();
  std::vector<Lane> lanes;
  for (int kind = 0; kind <= (rescaled ? 1 : 0); ++kind)
    for (int c = 0; c < channels; ++c) {
      const ChannelOptics& optics = medium.optics(c);
      const double extinction = h * (kind == 1 ? optics.sigma_t_beam : optics.true_sigma_t);
      const Volume& density = kind == 1 ? medium.beamDensity(c) : medium.medium().density;
      const auto same = std::find_if(lanes.begin(), lanes.end(), [&](const Lane& lane) {
        return shared && lane.extinction == extinction && lane.density == &density.values &&
               lane.rescaled == (kind == 1);
      });
      if (same != lanes.end())
        same->channels.push_back(c);
      else
        lanes.push_back({extinction, &density.values, kind == 1, {c}});
    }
  return lanes;
}

/// to += factor * marks in the active voxels.
VDB_DIFFUSE_KERNEL void addMarks(const float* marks, const uint8_t* active, float factor, float* to) {
  for (int row = 0; row < kBlockVoxels / 8; ++row) {
    if (!active[row]) continue;
    const Row value = loadRow(marks + 8 * row) * factor;
    storeRow(to + 8 * row, loadRow(to + 8 * row) + (rowMask(active[row]) ? value : Row{}));
  }
}

/// The part of a line of the lattice's rays in the box of all blocks begins here, in layers from the start.
std::optional<double> entryInBox(const Vec3d& start, const Vec3d& along, const Topology& topology) {
  double first = -std::numeric_limits<double>::infinity(), last = -first;
  for (int a = 0; a < 3; ++a) {
    const double low = topology.lowest()[a] - 0.5 - start[a], high = topology.highest()[a] + 0.5 - start[a];
    if (along[a] == 0) {
      if (low > 0 || high < 0) return std::nullopt;
      continue;
    }
    first = std::max(first, std::min(low / along[a], high / along[a]));
    last = std::min(last, std::max(low / along[a], high / along[a]));
  }
  if (!(first < last)) return std::nullopt;
  return first;
}

/// Marks the tiles of 8 x 8 rays that pass some block: `tiles` for each eight rows of the plane.
class TouchedTiles {
 public:
  TouchedTiles(const RayLattice& lattice, const Topology& topology)
      : pitch_((lattice.pitch + 7) / 8), touched_(static_cast<size_t>((lattice.rows + 7) / 8) * pitch_) {
    for (size_t b = 0; b < topology.blockCount(); ++b) {
      const Coord& origin = topology.origin(b);
      for (int w = 0; w < kBlockWidth; ++w) {
        const Layer& layer = lattice.layers[origin[lattice.w] + w - lattice.first_layer];
        for (int k = 0; k < layer.steps; ++k) {
          const int i = origin[lattice.u] - layer.step[k].shift_u - lattice.first_u,
                    j = origin[lattice.v] - layer.step[k].shift_v - lattice.first_v;
          for (int di : {0, 7})
            for (int dj : {0, 7}) touched_[static_cast<size_t>((i + di) / 8) * pitch_ + (j + dj) / 8] = 1;
        }
      }
    }
  }
  bool has(int row, int column) const { return touched_[static_cast<size_t>(row / 8) * pitch_ + column / 8]; }

 private:
  int pitch_;
  std::vector<uint8_t> touched_;
};

/// Beams that all come from afar, or all from surfaces.
class Passage {
 public:
  Passage(const BeamMedium& medium, int channels, const Occluder& occluder, const ReflectedLight& reflected,
          const std::vector<Beam>& beams, bool rescaled)
      : medium_(medium.medium()),
        occluder_(occluder),
        reflected_(reflected),
        beams_(beams),
        from_surfaces_(beams.front().from_surfaces),
        lanes_(lanesOf(medium, channels, rescaled, !from_surfaces_)),
        wavefront_(medium_.density.topology, stretch(), bundles()) {
    lattices_of_.resize(beams.size());
    for (int octant = 0; octant < Wavefront::kOctants; ++octant)
      for (const RayLattice& lattice : wavefront_.lattices(octant))
        lattices_of_[beam_of_[lattice.number]].push_back(&lattice);
    for (const auto& lattices : lattices_of_) {
      places_.push_back(layerPlaces(lattices));
      basis_.emplace_back();
      angularBasis(lattices.front()->s, basis_.back().data());
    }
  }

  void run(FirstScatter& sum, const Progress& progress, double done_before, double done_after) {
    int octants = 0;
    for (int octant = 0; octant < Wavefront::kOctants; ++octant)
      octants += !wavefront_.lattices(octant).empty();
    const double visits = static_cast<double>(octants) * lanes_.size() * medium_.topology().blockCount();
    std::atomic<size_t> visited{0};
    for (int octant = 0; octant < Wavefront::kOctants; ++octant) {
      if (wavefront_.lattices(octant).empty()) continue;
      std::vector<Wavefront::Rays> starts = startsOf(octant);
      for (size_t lane = 0; lane < lanes_.size(); ++lane)
        wavefront_.pass(octant, std::move(starts[lane]), [&](size_t b, Wavefront::Rays& rays) {
          passBlock(octant, lanes_[lane], b, rays, sum);
          const size_t n = ++visited;
          if (progress && n % 64 == 0)
            progress("source", done_before + (done_after - done_before) * static_cast<double>(n) / visits);
        });
    }
  }

 private:
  const Medium& medium_;
  const Occluder& occluder_;
  const ReflectedLight& reflected_;
  const std::vector<Beam>& beams_;
  bool from_surfaces_;
  std::vector<Lane> lanes_;
  std::vector<size_t> beam_of_;  // by bundle
  Wavefront wavefront_;
  std::vector<std::vector<const RayLattice*>> lattices_of_;  // by beam
  std::vector<std::vector<LayerPlaces>> places_;             // by beam and layer
  std::vector<std::array<double, kSecondOrder>> basis_;      // by beam

  Vec3d stretch() const { return medium_.transform().voxelSize() / medium_.transform().meanVoxelSize(); }
  Vec3d alongAxes(const Beam& beam) const {
    Vec3d s;
    for (int a = 0; a < 3; ++a)
      s[a] = beam.direction.dot(medium_.transform().axis(a)) / medium_.transform().axis(a).length();
    for (int a = 0; a < 3; ++a)
      if (std::abs(s[a]) < 1e-12) s[a] = 0;
    return s;
  }

  /// Lattices about the middle of the active voxels, so that a volume that is moved or mirrored is lit the
  /// same; through the voxels' centres for a beam along an axis, of which one is enough.
  std::vector<Wavefront::Bundle> bundles() {
    std::vector<Wavefront::Bundle> result;
    const auto [low, high] = medium_.topology().activeBox();
    const Vec3d middle = 0.5 * (low.asVec3d() + high.asVec3d());
    for (size_t n = 0; n < beams_.size(); ++n) {
      const Beam& beam = beams_[n];
      const Vec3d s = alongAxes(beam);
      const LatticeAxes axes = latticeAxes(s, stretch());
      if (s[axes.u] == 0 && s[axes.v] == 0) {
        const Vec3d centre(std::floor(middle[0]), std::floor(middle[1]), std::floor(middle[2]));
        result.push_back({s, 1, centre});
        beam_of_.push_back(n);
        continue;
      }
      for (int i = 0; i < beam.rays; ++i)
        for (int j = 0; j < beam.rays; ++j) {
          Vec3d through = middle;
          const std::array<double, 2> place = placeOfRay(beam, i, j);
          through[axes.u] += place[0] + asideOf(s[axes.u]);
          through[axes.v] += place[1] + asideOf(s[axes.v]);
          result.push_back({s, 1, through});
          beam_of_.push_back(n);
        }
    }
    return result;
  }

  /// The rays of every lane before they enter the volume.
  std::vector<Wavefront::Rays> startsOf(int octant) const {
    std::vector<Wavefront::Rays> starts;
    for (size_t lane = 0; lane < lanes_.size(); ++lane)
      starts.push_back(wavefront_.makeRays(octant, from_surfaces_ ? 0.0f : 1.0f));
    if (occluder_.empty()) return starts;
    const std::vector<RayLattice>& lattices = wavefront_.lattices(octant);
    for (size_t d = 0; d < lattices.size(); ++d) {
      const RayLattice& lattice = lattices[d];
      const TouchedTiles touched(lattice, medium_.topology());
      forEachBlock(
          static_cast<size_t>(lattice.rows),
          [&](size_t row) {
            for (int column = 0; column < lattice.pitch; ++column)
              if (touched.has(static_cast<int>(row), column)) {
                const size_t ray = row * lattice.pitch + column;
                Vec3d p = lattice.start;
                p[lattice.u] += static_cast<double>(row) + lattice.first_u;
                p[lattice.v] += static_cast<double>(column) + lattice.first_v;
                startRay(beams_[beam_of_[lattice.number]], p, lattice.along, [&](size_t lane, double light) {
                  starts[lane][d][ray] = static_cast<float>(light);
                });
              }
          },
          1);
    }
    return starts;
  }

  /// \param set  set(lane, light) for the lanes that differ from the start
  template <typename Set>
  void startRay(const Beam& beam, const Vec3d& p_index, const Vec3d& along, const Set& set) const {
    const std::optional<double> t = entryInBox(p_index, along, medium_.topology());
    if (!t) return;
    const Vec3d origin = medium_.transform().toWorld(p_index + along * *t);
    constexpr double kFar = std::numeric_limits<double>::infinity();
    if (!from_surfaces_) {
      if (occluder_.hidden(origin, -beam.direction, kFar))
        for (size_t lane = 0; lane < lanes_.size(); ++lane) set(lane, 0);
      return;
    }
    const auto hit = occluder_.closest(origin, -beam.direction, kFar);
    if (!hit) return;
    const ReflectedLight::Radiance radiance = reflected_.radiance(*hit, origin, -beam.direction);
    for (size_t lane = 0; lane < lanes_.size(); ++lane) {
      const Vec3d& light = lanes_[lane].rescaled ? radiance.beam : radiance.direct;
      set(lane, light[lanes_[lane].channels.front()]);
    }
  }

  void passBlock(int octant, const Lane& lane, size_t b, Wavefront::Rays& rays, FirstScatter& sum) const {
    const Topology& topology = medium_.topology();
    const std::vector<RayLattice>& lattices = wavefront_.lattices(octant);
    const float* rho = lane.density->block(b);
    alignas(64) float turned_rho[kBlockVoxels];
    turnBlock(rho, turned_rho);
    const RowBits active(topology.active(b));
    BeamMarks marks;
    Halo<float> halo;
    const float densest = takesShape(lane, sum) ? *std::max_element(rho, rho + kBlockVoxels) : 0;
    if (takesShape(lane, sum)) loadHalo(topology, *lane.density, b, 0.0f, halo);
    for (size_t d = 0; d < lattices.size();) {
      const size_t n = beam_of_[lattices[d].number];
      const bool turned = lattices[d].w == 2, shaped = takesShape(lane, sum);
      BeamBlock block{turned ? turned_rho : rho, turned ? active.turned : active.plain, 64, 8,
                      topology.origin(b)};
      if (lattices[d].w == 1) std::swap(block.stride_w, block.stride_u);
      const int axes[3] = {lattices[d].w, lattices[d].u, lattices[d].v};
      marks.clear(shaped);
      for (; d < lattices.size() && beam_of_[lattices[d].number] == n; ++d)
        passBeam(lattices[d], block, lane.extinction, 1.0 / static_cast<double>(lattices_of_[n].size()),
                 shaped ? &places_[n] : nullptr, rays[d].get(), marks);
      if (turned) turnMarksBack(shaped, marks);
      if (shaped) {
        const BeamFaces faces(lattices[d - 1].s, stretch(), lane.extinction);
        BlockMoments moments{marks.light, {}, {}};
        for (int a = 0; a < 3; ++a) {
          moments.lean[axes[a]] = marks.lean[a];
          moments.spread[axes[a]] = marks.spread[a];
        }
        if (faces.any(densest)) replaceMoments(faces, halo, moments);
      }
      leave(n, lane, b, marks, axes, active.plain, sum);
    }
  }

  /// The moments of what scatters belong to the rescaled light where there is one.
  static bool scatters(const Lane& lane, const FirstScatter& sum) {
    return lane.rescaled || sum.beam.empty();
  }
  static bool takesShape(const Lane& lane, const FirstScatter& sum) {
    return !sum.shape.empty() && scatters(lane, sum);
  }

  static void turnMarksBack(bool shaped, BeamMarks& marks) {
    alignas(64) float turned[kBlockVoxels];
    const auto back = [&](float* values) {
      std::copy_n(values, kBlockVoxels, turned);
      turnBack(turned, values);
    };
    back(marks.light);
    for (int a = 0; shaped && a < 3; ++a) {
      back(marks.lean[a]);
      back(marks.spread[a]);
    }
  }

  void leave(size_t n, const Lane& lane, size_t b, const BeamMarks& marks, const int axes[3],
             const uint8_t* active, FirstScatter& sum) const {
    const Beam& beam = beams_[n];
    const std::array<double, kSecondOrder>& basis = basis_[n];
    const Vec3d& s = lattices_of_[n].front()->s;
    for (int c : lane.channels) {
      const double power = from_surfaces_ ? beam.weight : beam.power[c];
      const auto add = [&](const float* from, double factor, Field<float>& to) {
        addMarks(from, active, static_cast<float>(power * factor), to.block(b));
      };
      add(marks.light, 1, lane.rescaled ? sum.beam[c] : sum.direct[c]);
      std::vector<VectorField>& flux = scatters(lane, sum) ? sum.beam_flux : sum.direct_flux;
      for (int a = 0; !flux.empty() && a < 3; ++a) add(marks.light, s[a], flux[c][a]);
      if (!scatters(lane, sum)) continue;
      for (size_t k = 0; !sum.second_moments.empty() && k < sum.second_moments[c].size(); ++k)
        add(marks.light, basis[kFirstOrder + k], sum.second_moments[c][k]);
      for (int a = 0; !sum.shape.empty() && a < 3; ++a) {
        add(marks.lean[a], 1, sum.shape[c].lean[axes[a]]);
        add(marks.spread[a], 1, sum.shape[c].spread[axes[a]]);
      }
    }
  }
};

}  // namespace

BeamSweep::BeamSweep(const BeamMedium& medium, int channels, const Occluder& occluder,
                     const ReflectedLight& reflected)
    : medium_(medium),
      channels_(channels),
      occluder_(occluder),
      reflected_(reflected),
      by_rays_(medium, channels, occluder, reflected) {}

void BeamSweep::add(const std::vector<Beam>& beams, FirstScatter& sum, const Progress& progress) const {
  const Topology& topology = medium_.medium().topology();
  if (beams.empty() || topology.blockCount() == 0) return;
  size_t done = 0;
  const auto part = [&](size_t n) { return static_cast<double>(n) / static_cast<double>(beams.size()); };
  for (const bool from_surfaces : {false, true}) {
    std::vector<Beam> some;
    size_t lattices = 0;
    for (const Beam& beam : beams)
      if (beam.from_surfaces == from_surfaces) {
        some.push_back(beam);
        lattices += static_cast<size_t>(beam.rays) * beam.rays;
      }
    if (some.empty()) continue;
    if (!by_rays_.surfacesInside() && !Wavefront::tooWide(topology, lattices)) {
      Passage(medium_, channels_, occluder_, reflected_, some, !sum.beam.empty())
          .run(sum, progress, part(done), part(done + some.size()));
      done += some.size();
      continue;
    }
    for (const Beam& beam : some) {
      by_rays_.add(beam, sum);
      if (progress) progress("source", part(++done));
    }
  }
}

}  // namespace vdb_diffuse
