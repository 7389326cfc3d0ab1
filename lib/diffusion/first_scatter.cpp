#include "diffusion/first_scatter.h"

#include <atomic>
#include <cmath>

#include "diffusion/beam_sweep.h"
#include "diffusion/light_march.h"
#include "scene/colour.h"

namespace vdb_diffuse {
namespace {

/// Rays a voxel and axis of one of many beams, where it is asked where in the voxels they scatter. One leaves
/// all it has on one line, and among many such voxels of two optical depths under an even sky end 2 % too
/// bright.
constexpr int kRaysForShape = 2;

/// Beams to sweep: those of the lights, and the directions of reflected light.
std::vector<Beam> beamsOf(const LightSamples& lights, const std::vector<Vec3d>& reflected,
                          const FirstScatterSettings& settings) {
  const int rays = std::max(1, settings.rays_per_voxel);
  std::vector<Beam> beams;
  const auto oneOfMany = [](Beam& beam, int index) {
    for (int a = 0; a < 2; ++a) beam.shift[a] = 0.5 + spreadPoint(index, a, 2);
  };
  for (const BeamSample& sample : lights.beams) {
    Beam beam;
    beam.direction = sample.direction;
    beam.power = sample.irradiance / (4 * M_PI);
    beam.rays = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(rays))));
    if (sample.count >= kManyBeams) {
      oneOfMany(beam, sample.index);
      beam.rays = settings.want_shape ? std::min(beam.rays, kRaysForShape) : 1;
    }
    beams.push_back(beam);
  }
  for (size_t n = 0; n < reflected.size(); ++n) {
    Beam beam;
    beam.direction = reflected[n];
    beam.from_surfaces = true;
    beam.weight = 1.0 / static_cast<double>(reflected.size());
    oneOfMany(beam, static_cast<int>(n));
    beams.push_back(beam);
  }
  return beams;
}

/// Fields for what is wanted, all zero.
FirstScatter emptyResult(const BeamMedium& medium, size_t channels, const FirstScatterSettings& settings) {
  const Topology& topology = medium.medium().topology();
  const bool rescaled = medium.rescaled();
  FirstScatter result;
  const auto vectorFields = [&] {
    std::vector<VectorField> fields(channels);
    for (VectorField& field : fields)
      for (Field<float>& component : field) component = Field<float>(topology);
    return fields;
  };
  for (size_t c = 0; c < channels; ++c) {
    result.direct.emplace_back(topology);
    if (rescaled) result.beam.emplace_back(topology);
  }
  if (medium.optics(0).g != 0 || settings.want_flux) result.beam_flux = vectorFields();
  if (rescaled && settings.want_flux) result.direct_flux = vectorFields();
  if (settings.want_shape) {
    const std::vector<VectorField> lean = vectorFields(), spread = lean;
    for (size_t c = 0; c < channels; ++c) result.shape.push_back({lean[c], spread[c]});
  }
  if (medium.optics(0).p2 != 0)
    for (size_t c = 0; c < channels; ++c) {
      result.second_moments.emplace_back();
      for (int k = kFirstOrder; k < kSecondOrder; ++k) result.second_moments[c].emplace_back(topology);
    }
  return result;
}

void addTo(FirstScatter& result, size_t b, int voxel, const Gathered& sum) {
  const size_t channels = result.direct.size();
  const auto add = [&](std::vector<VectorField>& fields, const Vec3d* flux) {
    for (size_t c = 0; c < fields.size(); ++c)
      for (int a = 0; a < 3; ++a) fields[c][a].block(b)[voxel] += static_cast<float>(flux[c][a]);
  };
  for (size_t c = 0; c < channels; ++c) {
    result.direct[c].block(b)[voxel] += static_cast<float>(sum.direct[c]);
    if (!result.beam.empty()) result.beam[c].block(b)[voxel] += static_cast<float>(sum.beam[c]);
  }
  add(result.beam_flux, result.beam.empty() ? sum.direct_flux : sum.beam_flux);
  add(result.direct_flux, sum.direct_flux);
  for (size_t c = 0; c < result.shape.size(); ++c)
    for (int a = 0; a < 3; ++a) {
      result.shape[c].lean[a].block(b)[voxel] += static_cast<float>(sum.lean[c][a]);
      result.shape[c].spread[a].block(b)[voxel] += static_cast<float>(sum.spread[c][a]);
    }
  for (size_t c = 0; c < result.second_moments.size(); ++c)
    for (int k = 0; k < kSecondOrder - kFirstOrder; ++k)
      result.second_moments[c][k].block(b)[voxel] += static_cast<float>(sum.second[c][k]);
}

}  // namespace

FirstScatter firstScatter(const Medium& medium, const Scene& scene, const Occluder& occluder, Model model,
                          const FirstScatterSettings& settings) {
  const Topology& topology = medium.topology();
  const BeamMedium beams(medium, model, settings.phase_order);
  const int channels = medium.grey() && greyScene(scene) ? 1 : 3;
  const LightSamples lights = sampleLights(scene, settings.lights);
  const ReflectedLight reflected(beams, lights, scene.surfaces, occluder);
  const std::vector<Vec3d> directions =
      reflected.any() ? sphereDirections(settings.gather_directions) : std::vector<Vec3d>();
  FirstScatter result = emptyResult(beams, static_cast<size_t>(channels), settings);
  if (topology.blockCount() == 0) return result;
  if (!settings.exact_march)
    BeamSweep(beams, channels, occluder, reflected)
        .add(beamsOf(lights, directions, settings), result, settings.progress);
  if (!settings.exact_march && lights.points.empty()) return result;

  const LightMarch march(beams, channels, occluder, lights, reflected, directions, settings);
  std::atomic<size_t> done{0};
  forEachBlock(topology.blockCount(), [&](size_t b) {
    const BlockMask& voxels = settings.only ? (*settings.only)[b] : topology.active(b);
    for (auto it = voxels.beginOn(); it; ++it) {
      const int voxel = static_cast<int>(it.pos());
      addTo(result, b, voxel, march.gather(b, voxel, settings.exact_march));
    }
    const size_t finished = ++done;
    if (settings.progress && finished % 64 == 0)
      settings.progress("source", static_cast<double>(finished) / topology.blockCount());
  });
  return result;
}

}  // namespace vdb_diffuse
