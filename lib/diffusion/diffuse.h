#pragma once

#include <functional>
#include <optional>
#include <string>

#include "diffusion/equation.h"
#include "medium/directions.h"
#include "multigrid/solve.h"
#include "scene/light_groups.h"

namespace vdb_diffuse {

/// One channel after its diffusion solve, as a method that goes on from there finds it and leaves it.
struct ChannelSolution {
  ChannelSolution(const Equation& e, Multigrid* m, const BeamSource& b, const std::vector<Field<float>>* q2,
                  const RightHandSide& right, const Occluder& o)
      : equation(e),
        multigrid(m),
        beams(b),
        Q2_moments(q2),
        rhs(right),
        occluder(o),
        scale(b.scale),
        I0(*e.A->topology) {}

  const Equation& equation;
  Multigrid* const multigrid;  ///< null where another solver took its place
  const BeamSource beams;
  const std::vector<Field<float>>* Q2_moments;  ///< their second moments; null unless `phase_order` is 2
  const RightHandSide& rhs;
  const Occluder& occluder;
  double scale;        ///< factor on the solution and on the right-hand side
  Field<double> I0;    ///< means over the voxels
  VectorField flux;    ///< I1 / 3 along the grid's axes, times scale; empty: what follows from I0
  double escaped = 0;  ///< flux of I0 through all open faces, in units of mean voxel sizes squared
  bool converged = true;
  int iterations = 0;
  double relative_residual = 0;
  int sweeps = 0;                         ///< of transport that were made
  std::optional<double> estimated_error;  ///< relative, if `refine` has formed one
  std::vector<std::string> warnings;
};

/// What solves a channel's equation in the place of multigrid.
class ChannelSolver {
 public:
  virtual ~ChannelSolver() = default;
  /// The beams as the method sees them.
  virtual FirstScatter light(const Scene& scene, const Occluder& occluder, Model model,
                             const FirstScatterSettings& usual) = 0;
  /// Directions in which the light is looked for that the medium returns to itself.
  virtual DirectionSet probe() const = 0;
  virtual void setUp(const Equation& equation) = 0;
  /// \param x  out: the solution of A x = b, in voxels
  virtual SolveReport solve(const Equation& equation, const RightHandSide& rhs, double tolerance,
                            Field<double>& x, std::vector<std::string>& warnings) = 0;
};

struct DiffuseSettings {
  ModelSettings model;
  FirstScatterSettings source;
  double tolerance = 1e-4;  ///< on the scaled residual; energy closes within ten times it
  int max_iterations = 2000;
  bool want_flux = false;
  ChannelSolver* solver = nullptr;               ///< null: multigrid
  std::function<void(ChannelSolution&)> refine;  ///< called for every channel that has light, may be empty
  Progress progress;
};

/// Powers in W (grey, or luminance where coloured), of the light that has scattered.
struct Energy {
  double scattered_in = 0, emitted = 0, absorbed = 0, escaped = 0;
  double closure() const {
    const double in = scattered_in + emitted;
    return in > 0 ? (in - absorbed - escaped) / in : 0;
  }
};

struct DiffuseResult {
  Channels diffuse;  ///< I_d0: mean over directions of the light that has scattered, W/m2/sr, >= 0
  Channels direct;   ///< I_ri0: of the light that has not
  VectorField flux;  ///< int I_d s dw in world axes, W/m2, luminance where coloured; only if wanted
  Energy energy;
  bool converged = true;
  int iterations = 0;            ///< of the channel that took most
  double relative_residual = 0;  ///< of the worst channel
  size_t levels = 0;
  int sweeps = 0;                         ///< of transport, of the channel that took most
  std::optional<double> estimated_error;  ///< of the worst channel, relative; see transport/error_estimate.h
  double mean_free_path_cap = 0;          ///< world units; 0: none
  size_t negative_voxels = 0;             ///< clamped to zero
  double most_negative = 0;               ///< what the worst of them was below zero, >= 0, W/m2/sr
  double seconds_source = 0, seconds_setup = 0, seconds_solve = 0, seconds_sweeps = 0;
  std::vector<std::string> warnings;
};

/// The whole of the paper: first scatter, the diffusion equation, I_d0 in every active voxel.
/// \throws InputError where the system is singular; Interrupted from `progress`
DiffuseResult diffuse(const Medium& medium, const Scene& scene, const DiffuseSettings& settings = {});

/// The same for each of at least one group of lights, over one operator where the medium is grey. Of the
/// seconds, `setup` serves all groups and is told of the first.
std::vector<DiffuseResult> diffuse(const Medium& medium, const std::vector<Surface>& surfaces,
                                   const std::vector<LightGroup>& groups, const DiffuseSettings& settings);

/// Adds a warning to a result without light that says why.
void warnOfDarkness(const Medium& medium, DiffuseResult& result);
void addOnce(const std::string& warning, std::vector<std::string>& warnings);

/// `sigma_s rho Q0 + sigma_a rho Q`, per unit length, of the unscaled medium.
Channels sourceField(const Medium& medium, const Channels& direct);

/// Weights of red, green, blue in luminance (Rec. 709).
constexpr double kLuminance[3] = {0.2126, 0.7152, 0.0722};

}  // namespace vdb_diffuse
