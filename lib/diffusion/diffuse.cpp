#include "diffusion/diffuse.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "diffusion/corner_light.h"
#include "diffusion/face_exchange.h"
#include "diffusion/light_result.h"
#include "diffusion/mean_depth.h"
#include "diffusion/returned_light.h"
#include "grid/error.h"
#include "scene/colour.h"

namespace vdb_diffuse {
namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Radiance that multiple scattering may raise tenfold without leaving a float's range.
constexpr double kStrongest = 1e36;

struct Largest {
  double value = 0;
  void operator+=(const Largest& o) { value = std::max(value, o.value); }
};

/// The power of two that brings the largest light near one, so that floats neither overflow nor vanish and a
/// scaled light gives the same bits scaled. Where a beam ends in one voxel of many optical depths, its mean
/// there is by as much less than the light that it scatters.
double normalisation(const Channels& direct, const Field<float>* glow, const Medium& medium,
                     const ChannelOptics& optics) {
  const double h = medium.transform().meanVoxelSize();
  const double largest = sumOverBlocks<Largest>(medium.topology().blockCount(), [&](size_t b) {
                           Largest most;
                           const float* rho = medium.density.values.block(b);
                           for (int n = 0; n < kBlockVoxels; ++n) {
                             const double depth = optics.at(b, n).sigma_t_beam * h * rho[n];
                             for (const Field<float>& channel : direct)
                               most += {std::abs(channel.block(b)[n]) * std::max(1.0, depth)};
                             if (glow) most += {std::abs(glow->block(b)[n] * medium.optics.emission_scale)};
                           }
                           return most;
                         }).value;
  if (!(largest < kStrongest))
    throw InputError("the light is too strong for 32-bit floats; give it in a larger unit");
  return largest > 0 ? std::ldexp(1.0, -std::ilogb(largest)) : 1;
}

/// On the tolerance of a solve that sweeps start from: each makes the light anew, and what is left of the
/// start's residual goes the way of the model's error. With 1e-4, a cloud of 3 optical depths a voxel was
/// 0.011 % RMS from what 1e-6 gives after one sweep and 0.008 % after two.
constexpr double kLooserStart = 10;

class Diffusion {
 public:
  Diffusion(const Medium& medium, const std::vector<Surface>& surfaces, const DiffuseSettings& settings)
      : medium_(medium), settings_(settings), scene_{{}, surfaces}, occluder_(scene_.surfaces) {}

  std::vector<DiffuseResult> run(const std::vector<LightGroup>& groups) {
    for (const LightGroup& group : groups) gatherSource(group);
    prepare();
    for (size_t c = 0; c < 3; ++c)
      for (LightResult& light : lights_)
        if (c < light.channels()) solveChannel(light, c);
    return finish();
  }

 private:
  const Medium& medium_;
  const DiffuseSettings& settings_;
  Scene scene_;  // its lights are those of the group at hand
  Occluder occluder_;
  std::vector<LightResult> lights_;  // of each group
  EquationSettings equation_settings_;
  std::unique_ptr<Equation> equation_;  // of the channel at hand; kept while it serves the next too
  std::unique_ptr<Multigrid> multigrid_;
  std::unique_ptr<const FaceProbe> probe_;
  std::unique_ptr<const FaceExchange> exchange_;  // of the equation; null where it does without
  /// What is said of all groups; seconds are of the work that serves all.
  double mean_free_path_cap_ = 0, seconds_setup_ = 0;
  size_t levels_ = 0;
  std::vector<std::string> warnings_;

  const Topology& topology() const { return medium_.topology(); }

  ChannelOptics opticsOf(size_t c) const {
    return channelOptics(medium_, static_cast<int>(c), settings_.model.model, settings_.source.phase_order);
  }

  void gatherSource(const LightGroup& group) {
    const double start = now();
    scene_.lights = group.lights;
    FirstScatterSettings first = settings_.source;
    first.want_flux = settings_.want_flux;
    first.want_shape = false;
    if (settings_.model.model == Model::kDefault)
      for (size_t c = 0; c < (medium_.greyOptics() ? 1 : 3) && !first.want_shape; ++c)
        first.want_shape = mostDepth(medium_, opticsOf(c)) > kThinVoxel;
    first.progress = settings_.progress;
    FirstScatter source = settings_.solver
                              ? settings_.solver->light(scene_, occluder_, settings_.model.model, first)
                              : firstScatter(medium_, scene_, occluder_, settings_.model.model, first);
    lights_.emplace_back(medium_, settings_, group.emission, std::move(source));
    lights_.back().seconds_source = now() - start;
  }

  void prepare() {
    const double cap = meanFreePathCap(settings_.model, medium_);
    equation_settings_.staircase = settings_.model.model == Model::kDefault;
    equation_settings_.profile = equation_settings_.staircase && !settings_.solver;
    equation_settings_.diagonal = !settings_.solver;
    equation_settings_.cap = cap;
    equation_settings_.surfaces = &scene_.surfaces;
    equation_settings_.walls =
        std::make_shared<const Walls>(findWalls(topology(), medium_.transform(), occluder_, scene_.surfaces));
    mean_free_path_cap_ = std::isfinite(cap) ? cap : 0;
  }

  /// One operator serves all channels of a grey medium, unless coloured surfaces change what returns.
  bool sharedOperator() const {
    if (!medium_.greyOptics()) return false;
    if (equation_settings_.walls->empty() && settings_.model.model != Model::kDefault) return true;
    return greySurfaces(scene_.surfaces);
  }

  void setUp(size_t c) {
    if (equation_ && sharedOperator()) return;
    const double start = now();
    multigrid_.reset();
    const ChannelOptics optics = opticsOf(c);
    double part = 0;  // of the light that leaves and comes back
    if (settings_.model.model == Model::kDefault) {
      if (settings_.progress) settings_.progress("surface", 0);
      if (!probe_)
        probe_ =
            std::make_unique<const FaceProbe>(medium_, occluder_, scene_.surfaces, *equation_settings_.walls,
                                              settings_.solver ? settings_.solver->probe() : offPlanes());
      equation_settings_.returned =
          std::make_shared<const Field<float>>(returnedLight(*probe_, optics, static_cast<int>(c), &part));
    }
    equation_ = std::make_unique<Equation>(
        formEquation(medium_, optics, static_cast<int>(c), settings_.model.model, equation_settings_));
    exchange_.reset();
    if (probe_ && !settings_.solver)
      if (const double share = FaceExchange::shareOf(medium_, optics); share > 0)
        exchange_ = std::make_unique<const FaceExchange>(*probe_, *equation_, share, part);
    if (!exchange_ && sharedOperator()) probe_.reset();
    if (equation_->floored_voxels > 0 && c == 0)
      warnings_.push_back(std::to_string(equation_->floored_voxels) +
                          " voxels are a vacuum to a solve without a mean-free-path cap: their diffusion "
                          "coefficient is bounded");
    if (settings_.solver) {
      settings_.solver->setUp(*equation_);
    } else {
      if (!settings_.refine && !exchange_)
        equation_->settings.returned = equation_settings_.returned = nullptr;  // has served
      multigrid_ = std::make_unique<Multigrid>(equation_->A);
      levels_ = multigrid_->levelCount();
    }
    seconds_setup_ += now() - start;
  }

  void solveChannel(LightResult& light, size_t c) {
    const ChannelOptics optics = opticsOf(c);
    FirstScatter& source = light.source;
    BeamSource beams;
    beams.Q0 = &source.sourceOf(c);
    if (!source.beam_flux.empty()) beams.Q1_flux = &source.beam_flux[c];
    if (!source.shape.empty() && mostDepth(medium_, optics) > kThinVoxel) beams.shape = &source.shape[c];
    if (light.emission() && !medium_.emission.empty() && optics.absorbs() &&
        medium_.optics.emission_scale != 0)
      beams.glow = &medium_.emissionIn(static_cast<int>(c));
    beams.scale = normalisation(source.direct, beams.glow, medium_, optics);
    if (optics.true_sigma_s == 0 && !beams.glow) return light.addDark();
    setUp(c);
    double start = now();
    Field<float> gathered;
    if (exchange_ && beams.shape) {
      gathered = gatherCornerLight(*equation_, medium_, beams, exchange_->share());
      beams.gathered = &gathered;
    }
    FaceValues heads, incoming;
    RightHandSide rhs = formRightHandSide(*equation_, medium_, beams, exchange_ ? &heads : nullptr);
    if (!settings_.refine && !settings_.want_flux) {
      beams.shape = nullptr;
      beams.Q1_flux = nullptr;
      light.forgetShape(c);
    }
    const std::vector<Field<float>>* second =
        source.second_moments.empty() ? nullptr : &source.second_moments[c];
    if (exchange_) beams.incoming = &incoming;
    ChannelSolution channel(*equation_, multigrid_.get(), beams, second, rhs, occluder_);
    if (exchange_) {
      solveSystem(channel, kLooserStart * settings_.tolerance, 0);
      incoming = exchange_->incoming(beams, heads, channel.I0, settings_.progress);
      addIncoming(*equation_, incoming, rhs);
    }
    solveEquation(channel);
    light.seconds_solve += now() - start;
    if (settings_.refine) {
      start = now();
      settings_.refine(channel);
      light.seconds_sweeps += now() - start;
    }
    light.add(c, optics, channel);
  }

  void solveSystem(ChannelSolution& channel, double tolerance, double balance) {
    SolveSettings solving;
    solving.tolerance = std::min(tolerance, 0.1);
    solving.balance = balance;
    solving.max_iterations = settings_.max_iterations;
    solving.progress = settings_.progress;
    const SolveReport report = settings_.solver
                                   ? settings_.solver->solve(*equation_, channel.rhs, settings_.tolerance,
                                                             channel.I0, channel.warnings)
                                   : solve(*multigrid_, channel.rhs.b, channel.I0, solving);
    channel.converged = channel.converged && report.converged;
    channel.iterations += report.iterations;
    channel.relative_residual = report.relative_residual;
    if (!std::isfinite(report.relative_residual))
      throw InputError("densities, lights or voxels are so large or so small that 32-bit floats overflow");
  }

  void solveEquation(ChannelSolution& channel) {
    if (settings_.refine)
      solveSystem(channel, kLooserStart * settings_.tolerance, 0);
    else
      solveSystem(channel, settings_.tolerance, 10 * settings_.tolerance);
    meansOfSolution(*equation_, medium_, channel.I0);
    channel.escaped = escapedThrough(*equation_, medium_, channel.I0) + channel.rhs.drive_out;
  }

  std::vector<DiffuseResult> finish() {
    std::vector<DiffuseResult> results;
    for (LightResult& light : lights_) {
      results.push_back(light.finish());
      results.back().mean_free_path_cap = mean_free_path_cap_;
      results.back().levels = levels_;
      for (const std::string& warning : warnings_) addOnce(warning, results.back().warnings);
    }
    results.front().seconds_setup = seconds_setup_;
    return results;
  }
};

}  // namespace

void addOnce(const std::string& warning, std::vector<std::string>& warnings) {
  if (std::find(warnings.begin(), warnings.end(), warning) == warnings.end()) warnings.push_back(warning);
}

std::vector<DiffuseResult> diffuse(const Medium& medium, const std::vector<Surface>& surfaces,
                                   const std::vector<LightGroup>& groups, const DiffuseSettings& settings) {
  const KeepArrays arrays;
  return Diffusion(medium, surfaces, settings).run(groups);
}

DiffuseResult diffuse(const Medium& medium, const Scene& scene, const DiffuseSettings& settings) {
  DiffuseResult result = std::move(diffuse(medium, scene.surfaces, {{"", scene.lights}}, settings).front());
  warnOfDarkness(medium, result);
  return result;
}

void warnOfDarkness(const Medium& medium, DiffuseResult& result) {
  if (result.energy.scattered_in + result.energy.emitted > 0) return;
  double light = 0;
  for (const Field<float>& channel : result.direct)
    light += sumOverVoxels(medium.topology(), [&](size_t b, int n) { return channel.block(b)[n]; });
  addOnce(light > 0 ? "the medium scatters nothing and emits nothing: diffuse is zero"
                    : "no light reaches the volume: the result is zero",
          result.warnings);
}

Channels sourceField(const Medium& medium, const Channels& direct) {
  Channels source;
  for (size_t c = 0; c < 3; ++c) {
    if (c == 1 && direct.size() == 1 && medium.grey()) break;
    const Field<float>& light = direct[std::min(c, direct.size() - 1)];
    Field<float> field(medium.topology());
    const ChannelOptics optics = channelOptics(medium, static_cast<int>(c), Model::kP1);
    forEachBlock(field.blockCount(), [&](size_t b) {
      const float* rho = medium.density.values.block(b);
      for (int n = 0; n < kBlockVoxels; ++n) {
        const ChannelOptics there = optics.at(b, n);
        const double sigma_s = there.true_sigma_s, emission = there.sigma_a * medium.optics.emission_scale;
        const double Q = medium.emission.empty() ? 0 : medium.emissionIn(static_cast<int>(c)).block(b)[n];
        field.block(b)[n] = static_cast<float>(rho[n] * (sigma_s * light.block(b)[n] + emission * Q));
      }
    });
    source.push_back(std::move(field));
  }
  return source;
}

}  // namespace vdb_diffuse
