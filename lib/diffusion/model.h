#pragma once

#include <optional>

#include "medium/medium.h"

namespace vdb_diffuse {

/// Which equations. kDefault: P1 with the staircase area factor, the light that comes back to the medium, the
/// mean-free-path cap and, for g > 0, delta-Eddington. kP1: the corrected P1 equations and none of these.
/// kPaper: as Stam (1995) prints them.
enum class Model { kDefault, kP1, kPaper };

struct ModelSettings {
  Model model = Model::kDefault;
  /// Length L in D = 1/(3 max(sigma_tr rho, 1/L)), world units, > 0; infinity: no cap; unset: the model's
  /// own, which is 0.5 times the cube root of the active volume for kDefault and no cap for the others.
  std::optional<double> mean_free_path_cap;
};

/// One colour channel of a medium as the diffusion equation sees it.
///
/// Delta-Eddington (Joseph, Wiscombe and Weinman 1976) moves the forward peak of the phase function into the
/// beam: f = g^2, sigma_s' = (1-f) sigma_s, g' = g/(1+g); sigma_a and sigma_tr do not change.
struct ChannelOptics {
  double sigma_s = 1;  ///< of the diffusion equation, 1/(length density): sigma_s' where rescaled
  double sigma_a = 0;
  double sigma_tr = 1;      ///< sigma_a + (1-g) sigma_s, the same before and after rescaling
  double g = 0;             ///< of the first scatter's linear part: g' where rescaled
  double p2 = 0;            ///< second Legendre moment of the phase function; kept for `phase_order` 2 only
  double sigma_t_beam = 1;  ///< attenuates the beam: sigma_a + sigma_s'
  double true_sigma_s = 1, true_sigma_t = 1;
  double source_sigma = 1;  ///< in the source term, sigma_s'; the paper prints sigma_t
  double flux_factor = 1;   ///< 3 where the paper prints kappa = 1/(sigma_tr rho) instead of a third of it
  double true_g = 0;
  /// The medium's: all above is said of where it is 1. Null: everywhere.
  const Field<float>* albedo_field = nullptr;

  bool rescaled() const { return sigma_t_beam != true_sigma_t; }
  /// Is anything absorbed anywhere?
  bool absorbs() const { return sigma_a > 0 || albedo_field; }
  double albedo() const { return sigma_t_beam > 0 ? sigma_s / sigma_t_beam : 0; }

  /// Where the albedo field is a: what no longer scatters is absorbed, also of the light that the rescaling
  /// has left in the beam.
  ChannelOptics where(double a) const {
    ChannelOptics there = *this;
    const double lost = (1 - a) * true_sigma_s;
    there.sigma_s *= a;
    there.sigma_a += lost;
    there.sigma_tr += true_g * lost;
    there.sigma_t_beam += (1 - a) * (true_sigma_s - sigma_s);
    there.true_sigma_s *= a;
    if (flux_factor == 1) there.source_sigma *= a;  // as printed it is sigma_t
    there.albedo_field = nullptr;
    return there;
  }
  ChannelOptics at(size_t block, int voxel) const {
    return albedo_field ? where(albedo_field->block(block)[voxel]) : *this;
  }
};

/// Without the albedo field, which only a medium has.
/// \param phase_order  moments of the phase function that are kept beside its mean. 1, for diffusion: f = g^2
/// above. 2, for transport: f = g^3, g' = g (1+g)/(1+g+g^2), p2' = (g^2-f)/(1-f), so that l = 3 is exact as
/// well.
ChannelOptics channelOptics(const Optics& optics, int channel, Model model, int phase_order = 1);
/// The same with the albedo field. \param medium  must outlive the result
ChannelOptics channelOptics(const Medium& medium, int channel, Model model, int phase_order = 1);

/// The cap in world units; infinity where there is none.
double meanFreePathCap(const ModelSettings& settings, const Medium& medium);

/// With the cap off, a density so low that the mean free path exceeds this many times the cloud's own size
/// (the cube root of its active volume) is a vacuum to it; D is bounded there, and such voxels are counted.
constexpr double kVacuumPath = 1000;

}  // namespace vdb_diffuse
