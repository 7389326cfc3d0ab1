#include "diffusion/diffuse.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "diffusion/equation.h"
#include "diffusion/returned_light.h"

namespace vdb_diffuse {
namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Sum of term(block, voxel) over the active voxels.
template <typename Term>
double sumOverVoxels(const Topology& topology, const Term& term) {
  return sumOverBlocks<double>(topology.blockCount(), [&](size_t b) {
    double sum = 0;
    for (auto it = topology.active(b).beginOn(); it; ++it) sum += term(b, static_cast<int>(it.pos()));
    return sum;
  });
}

/// The power of two that brings a field's largest value near one, so that floats neither overflow nor vanish
/// and a scaled light gives the same bits scaled.
double normalisation(const Channels& direct, const Medium& medium, const ChannelOptics& optics) {
  float largest = 0;
  const auto consider = [&](const Field<float>& field, double factor) {
    for (size_t i = 0; i < field.size(); ++i)
      largest = std::max(largest, static_cast<float>(std::abs(field[i] * factor)));
  };
  for (const Field<float>& channel : direct) consider(channel, 1);
  if (!medium.emission.empty() && optics.sigma_a > 0) consider(medium.emission, medium.optics.emission_scale);
  return largest > 0 ? std::ldexp(1.0, -std::ilogb(largest)) : 1;
}

/// Voxels of at most this optical depth scatter a beam evenly; in thicker ones the equation asks where.
constexpr double kThinVoxel = 0.3;

/// On the tolerance of a solve that sweeps start from: each makes the light anew, and what is left of the
/// start's residual goes the way of the model's error. With 1e-4, a cloud of 3 optical depths a voxel was
/// 0.011 % RMS from what 1e-6 gives after one sweep and 0.008 % after two.
constexpr double kLooserStart = 10;

class Diffusion {
 public:
  Diffusion(const Medium& medium, const Scene& scene, const DiffuseSettings& settings)
      : medium_(medium), scene_(scene), settings_(settings), occluder_(scene.surfaces) {}

  DiffuseResult run() {
    gatherSource();
    prepare();
    for (size_t c = 0; c < channels(); ++c) solveChannel(c);
    finish();
    return std::move(result_);
  }

 private:
  const Medium& medium_;
  const Scene& scene_;
  const DiffuseSettings& settings_;
  Occluder occluder_;
  FirstScatter source_;
  EquationSettings equation_settings_;
  std::unique_ptr<Equation> equation_;  // of the channel at hand; kept while it serves the next too
  std::unique_ptr<Multigrid> multigrid_;
  std::unique_ptr<const ReturnedLight> returned_;
  DiffuseResult result_;

  const Topology& topology() const { return medium_.topology(); }
  size_t channels() const { return source_.direct.size(); }
  double weight(size_t c) const { return channels() == 1 ? 1 : kLuminance[c]; }

  /// Does any voxel have so many optical depths that the equation must know where in it light scatters?
  bool hasThickVoxels(double sigma_t) const {
    float densest = 0;
    for (size_t i = 0; i < medium_.density.values.size(); ++i)
      densest = std::max(densest, medium_.density.values[i]);
    return densest * sigma_t * medium_.transform().meanVoxelSize() > kThinVoxel;
  }

  ChannelOptics opticsOf(size_t c) const {
    return channelOptics(medium_.optics, static_cast<int>(c), settings_.model.model,
                         settings_.source.phase_order);
  }

  void gatherSource() {
    const double start = now();
    FirstScatterSettings first = settings_.source;
    first.want_flux = settings_.want_flux;
    double sigma_t = 0;
    for (int c = 0; c < 3; ++c) sigma_t = std::max(sigma_t, opticsOf(c).sigma_t_beam);
    first.want_shape = settings_.model.model == Model::kDefault && hasThickVoxels(sigma_t);
    first.progress = settings_.progress;
    source_ = settings_.solver ? settings_.solver->light(scene_, occluder_, settings_.model.model, first)
                               : firstScatter(medium_, scene_, occluder_, settings_.model.model, first);
    result_.seconds_source = now() - start;
  }

  void prepare() {
    const double cap = meanFreePathCap(settings_.model, medium_);
    equation_settings_.staircase = settings_.model.model == Model::kDefault;
    equation_settings_.profile = equation_settings_.staircase && !settings_.solver;
    equation_settings_.cap = cap;
    equation_settings_.surfaces = &scene_.surfaces;
    equation_settings_.walls =
        std::make_shared<const Walls>(findWalls(topology(), medium_.transform(), occluder_, scene_.surfaces));
    result_.mean_free_path_cap = std::isfinite(cap) ? cap : 0;
    if (settings_.want_flux)
      for (Field<float>& component : result_.flux) component = Field<float>(topology());
  }

  /// One operator serves all channels of a grey medium, unless coloured surfaces change what returns.
  bool sharedOperator() const {
    if (!medium_.optics.grey()) return false;
    if (equation_settings_.walls->empty() && settings_.model.model != Model::kDefault) return true;
    for (const Surface& s : scene_.surfaces)
      if (s.albedo[0] != s.albedo[1] || s.albedo[0] != s.albedo[2]) return false;
    return true;
  }

  void setUp(size_t c) {
    if (equation_ && sharedOperator()) return;
    const double start = now();
    multigrid_.reset();
    const ChannelOptics optics = opticsOf(c);
    if (settings_.model.model == Model::kDefault) {
      if (settings_.progress) settings_.progress("surface", 0);
      if (!returned_)
        returned_ = std::make_unique<const ReturnedLight>(medium_, occluder_, scene_.surfaces,
                                                          *equation_settings_.walls);
      equation_settings_.returned =
          std::make_shared<const Field<float>>(returned_->factors(optics.sigma_t_beam, static_cast<int>(c)));
      if (sharedOperator()) returned_.reset();
    }
    equation_ = std::make_unique<Equation>(
        formEquation(medium_, optics, static_cast<int>(c), settings_.model.model, equation_settings_));
    if (equation_->floored_voxels > 0 && c == 0)
      result_.warnings.push_back(
          std::to_string(equation_->floored_voxels) +
          " voxels are a vacuum to a solve without a mean-free-path cap: their diffusion "
          "coefficient is bounded");
    if (settings_.solver) {
      settings_.solver->setUp(*equation_);
    } else {
      if (!settings_.refine)
        equation_->settings.returned = equation_settings_.returned = nullptr;  // has served
      multigrid_ = std::make_unique<Multigrid>(equation_->A);
      result_.levels = multigrid_->levelCount();
    }
    result_.seconds_setup += now() - start;
  }

  /// Frees what only the right-hand side, or a flux that is wanted, asks for.
  void forgetShape(size_t c, BeamSource& beams) {
    if (settings_.want_flux) return;
    beams.shape = nullptr;
    beams.Q1_flux = nullptr;
    if (!source_.shape.empty()) source_.shape[c] = {};
    if (!source_.beam_flux.empty()) source_.beam_flux[c] = {};
  }

  void solveChannel(size_t c) {
    const ChannelOptics optics = opticsOf(c);
    BeamSource beams;
    beams.Q0 = &source_.sourceOf(c);
    if (!source_.beam_flux.empty()) beams.Q1_flux = &source_.beam_flux[c];
    if (!source_.shape.empty() && hasThickVoxels(optics.sigma_t_beam)) beams.shape = &source_.shape[c];
    beams.scale = normalisation(source_.direct, medium_, optics);
    const bool emits = !medium_.emission.empty() && optics.sigma_a > 0 && medium_.optics.emission_scale != 0;
    if (optics.true_sigma_s == 0 && !emits) {  // nothing scatters and nothing glows: no equation to solve
      result_.diffuse.emplace_back(topology());
      return;
    }
    setUp(c);
    double start = now();
    const RightHandSide rhs = formRightHandSide(*equation_, medium_, beams);
    if (!settings_.refine) forgetShape(c, beams);
    const std::vector<Field<float>>* second =
        source_.second_moments.empty() ? nullptr : &source_.second_moments[c];
    ChannelSolution channel(*equation_, multigrid_.get(), beams, second, rhs, occluder_);
    SolveSettings solve_settings;
    solve_settings.tolerance = settings_.tolerance;
    solve_settings.balance = 10 * settings_.tolerance;
    if (settings_.refine) {
      solve_settings.tolerance = std::min(kLooserStart * settings_.tolerance, 0.1);
      solve_settings.balance = 0;
    }
    solve_settings.max_iterations = settings_.max_iterations;
    solve_settings.progress = settings_.progress;
    const SolveReport report =
        settings_.solver
            ? settings_.solver->solve(*equation_, rhs, settings_.tolerance, channel.I0, channel.warnings)
            : solve(*multigrid_, rhs.b, channel.I0, solve_settings);
    channel.converged = report.converged;
    channel.iterations = report.iterations;
    channel.relative_residual = report.relative_residual;
    meansOfSolution(*equation_, medium_, channel.I0);
    channel.escaped = escapedThrough(*equation_, medium_, channel.I0) + rhs.drive_out;
    result_.seconds_solve += now() - start;
    if (settings_.refine) {
      start = now();
      settings_.refine(channel);
      result_.seconds_sweeps += now() - start;
    }
    result_.converged = result_.converged && channel.converged;
    result_.iterations = std::max(result_.iterations, channel.iterations);
    result_.sweeps = std::max(result_.sweeps, channel.sweeps);
    for (const std::string& warning : channel.warnings)
      if (std::find(result_.warnings.begin(), result_.warnings.end(), warning) == result_.warnings.end())
        result_.warnings.push_back(warning);
    if (channel.estimated_error)
      result_.estimated_error = std::max(result_.estimated_error.value_or(0), *channel.estimated_error);
    result_.relative_residual = std::max(result_.relative_residual, channel.relative_residual);
    addEnergy(c, optics, channel);
    store(c, channel);
  }

  double absorbedOf(const Equation& e, const Field<double>& x) const {
    const double tau_a = e.optics.sigma_a * e.h;
    const Field<float>& rho = medium_.density.values;
    return sumOverVoxels(topology(), [&](size_t b, int n) {
      return static_cast<double>(static_cast<float>(tau_a * rho.block(b)[n])) * x.block(b)[n];
    });
  }

  /// Powers of the light that has scattered. With delta-Eddington the equation's own light is split
  /// otherwise: what the rescaling left in the beam has scattered too, and leaves where the beam does.
  void addEnergy(size_t c, const ChannelOptics& optics, const ChannelSolution& channel) {
    const Equation& e = channel.equation;
    const RightHandSide& rhs = channel.rhs;
    const double unscale = 1 / channel.scale, tau_a = optics.sigma_a * e.h;
    const Field<float>& rho = medium_.density.values;
    const double absorbed = absorbedOf(e, channel.I0);
    const double watts = 4 * M_PI * medium_.transform().voxelVolume() / e.h * weight(c);
    Energy& energy = result_.energy;
    energy.emitted += watts * unscale * rhs.emitted;
    if (source_.beam.empty()) {
      energy.scattered_in += watts * unscale * rhs.scattered_in;
      energy.absorbed += watts * unscale * absorbed;
      energy.escaped += watts * unscale * channel.escaped;
      return;
    }
    const double direct = sumOverVoxels(topology(), [&](size_t b, int n) {
      return static_cast<double>(rho.block(b)[n]) * source_.direct[c].block(b)[n];
    });
    const double beam = sumOverVoxels(topology(), [&](size_t b, int n) {
      return static_cast<double>(rho.block(b)[n]) * source_.beam[c].block(b)[n];
    });
    const double left_in_beam = e.h * (optics.true_sigma_t * direct - optics.sigma_t_beam * beam);
    energy.scattered_in += watts * e.h * optics.true_sigma_s * direct;
    energy.absorbed += watts * (unscale * absorbed + tau_a * (beam - direct));
    energy.escaped += watts * (unscale * channel.escaped + left_in_beam);
  }

  void store(size_t c, const ChannelSolution& channel) {
    const double unscale = 1 / channel.scale;
    Field<float> diffuse(topology());
    const bool rescaled = !source_.beam.empty();
    result_.negative_voxels += sumOverBlocks<size_t>(topology().blockCount(), [&](size_t b) {
      size_t negative = 0;
      for (auto it = topology().active(b).beginOn(); it; ++it) {
        const int n = static_cast<int>(it.pos());
        double value = channel.I0.block(b)[n] * unscale;
        if (rescaled)
          value += static_cast<double>(source_.beam[c].block(b)[n]) - source_.direct[c].block(b)[n];
        negative += value < 0;
        diffuse.block(b)[n] = static_cast<float>(std::max(0.0, value));
      }
      return negative;
    });
    if (settings_.want_flux) addFlux(c, channel);
    result_.diffuse.push_back(std::move(diffuse));
  }

  void addFlux(size_t c, const ChannelSolution& channel) {
    VectorField third;  // I1 / 3 along the grid axes, scaled as the solution is
    const bool given = !channel.flux[0].empty();
    if (!given) {
      for (Field<float>& component : third) component = Field<float>(topology());
      diffusiveFlux(channel.equation, medium_, channel.I0, channel.beams, &third);
    }
    const VectorField& along_axes = given ? channel.flux : third;
    forEachBlock(topology().blockCount(), [&](size_t b) {
      for (auto it = topology().active(b).beginOn(); it; ++it) {
        const int n = static_cast<int>(it.pos());
        Vec3d world(0);
        for (int a = 0; a < 3; ++a) {
          double along = along_axes[a].block(b)[n] / channel.scale;
          if (!source_.direct_flux.empty())
            along += source_.beam_flux[c][a].block(b)[n] - source_.direct_flux[c][a].block(b)[n];
          world += medium_.transform().axis(a) / medium_.transform().axis(a).length() * along;
        }
        for (int a = 0; a < 3; ++a)
          result_.flux[a].block(b)[n] += static_cast<float>(4 * M_PI * weight(c) * world[a]);
      }
    });
  }

  void finish() {
    result_.direct = std::move(source_.direct);
    if (settings_.refine && std::abs(result_.energy.closure()) > 10 * settings_.tolerance)
      result_.converged = false;
    if (result_.energy.scattered_in + result_.energy.emitted > 0) return;
    double light = 0;
    for (const Field<float>& channel : result_.direct)
      light += sumOverVoxels(topology(), [&](size_t b, int n) { return channel.block(b)[n]; });
    result_.warnings.push_back(light > 0 ? "the medium scatters nothing and emits nothing: diffuse is zero"
                                         : "no light reaches the volume: the result is zero");
  }
};

}  // namespace

DiffuseResult diffuse(const Medium& medium, const Scene& scene, const DiffuseSettings& settings) {
  return Diffusion(medium, scene, settings).run();
}

Channels sourceField(const Medium& medium, const Channels& direct) {
  Channels source;
  for (size_t c = 0; c < 3; ++c) {
    if (c == 1 && direct.size() == 1 && medium.optics.grey()) break;
    const Field<float>& light = direct[std::min(c, direct.size() - 1)];
    Field<float> field(medium.topology());
    const double sigma_s = medium.optics.sigma_s[static_cast<int>(c)];
    const double emission = medium.optics.sigma_a[static_cast<int>(c)] * medium.optics.emission_scale;
    forEachBlock(field.blockCount(), [&](size_t b) {
      const float* rho = medium.density.values.block(b);
      for (int n = 0; n < kBlockVoxels; ++n) {
        const double Q = medium.emission.empty() ? 0 : medium.emission.block(b)[n];
        field.block(b)[n] = static_cast<float>(rho[n] * (sigma_s * light.block(b)[n] + emission * Q));
      }
    });
    source.push_back(std::move(field));
  }
  return source;
}

}  // namespace vdb_diffuse
