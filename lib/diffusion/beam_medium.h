#pragma once

#include <memory>

#include "diffusion/model.h"

namespace vdb_diffuse {

/// Something of light that has not collided: through the medium as it is, and through the rescaled one, where
/// what scatters nearly straight on comes through too.
struct TwofoldLight {
  Vec3d direct{0, 0, 0}, beam{0, 0, 0};
};

/// The medium as light that has not collided meets it, channel by channel.
///
/// An albedo field leaves the extinction as it is, but not that of the rescaled medium: what scatters
/// straight on is then absorbed in part. There a beam meets another density,
///
///     sigma_t_beam rho_beam = (sigma_t_beam + (1 - a) (sigma_s - sigma_s')) rho
class BeamMedium {
 public:
  /// \param medium  must outlive the object
  BeamMedium(const Medium& medium, Model model, int phase_order);

  const Medium& medium() const { return medium_; }
  const ChannelOptics& optics(int channel) const { return optics_[channel]; }
  /// Is the rescaled medium another one?
  bool rescaled() const { return optics_[0].rescaled() || optics_[2].rescaled(); }
  /// rho_beam; where it is not another, the medium's own density itself.
  const Volume& beamDensity(int channel) const { return own_[channel] ? *own_[channel] : medium_.density; }
  /// Column of density, world length, after which light counts as gone in every channel.
  double enough() const { return enough_; }

  /// Part of the light that comes through, from a point of the world along a unit vector.
  TwofoldLight transmittance(const Vec3d& from, const Vec3d& toward, double distance) const;

 private:
  const Medium& medium_;
  ChannelOptics optics_[3];
  std::shared_ptr<const Volume> own_[3];
  double enough_;
};

}  // namespace vdb_diffuse
