#include "diffusion/beam_medium.h"

#include <algorithm>

#include "medium/transmittance.h"

namespace vdb_diffuse {
namespace {

std::shared_ptr<const Volume> beamDensityOf(const Medium& medium, const ChannelOptics& optics) {
  const Volume& density = medium.density;
  auto own = std::make_shared<Volume>(
      Volume{density.name, density.topology, density.transform, Field<float>(*density.topology)});
  forEachBlock(density.values.blockCount(), [&](size_t b) {
    const float* rho = density.values.block(b);
    for (int n = 0; n < kBlockVoxels; ++n)
      own->values.block(b)[n] =
          static_cast<float>(optics.at(b, n).sigma_t_beam / optics.sigma_t_beam * rho[n]);
  });
  return own;
}

/// Do beams of both meet the same?
bool alike(const ChannelOptics& a, const ChannelOptics& b) {
  return a.true_sigma_s == b.true_sigma_s && a.sigma_a == b.sigma_a && a.albedo_field == b.albedo_field;
}

}  // namespace

BeamMedium::BeamMedium(const Medium& medium, Model model, int phase_order) : medium_(medium) {
  double thinnest = std::numeric_limits<double>::infinity();
  for (int c = 0; c < 3; ++c) {
    optics_[c] = channelOptics(medium, c, model, phase_order);
    thinnest = std::min({thinnest, optics_[c].sigma_t_beam, optics_[c].true_sigma_t});
    if (!optics_[c].albedo_field || !optics_[c].rescaled()) continue;
    own_[c] = c > 0 && alike(optics_[c], optics_[c - 1]) ? own_[c - 1] : beamDensityOf(medium, optics_[c]);
  }
  enough_ = kOpaque / thinnest;
}

TwofoldLight BeamMedium::transmittance(const Vec3d& from, const Vec3d& toward, double distance) const {
  const Vec3d p = medium_.transform().toIndex(from), d = medium_.transform().directionToIndex(toward);
  const double column = columnDensity(medium_.density, p, d, 0, distance, enough_);
  const Volume* met = &medium_.density;
  double beam_column = column;
  TwofoldLight part;
  for (int c = 0; c < 3; ++c) {
    if (&beamDensity(c) != met) {
      met = &beamDensity(c);
      beam_column = columnDensity(*met, p, d, 0, distance, enough_);
    }
    part.direct[c] = std::exp(-optics_[c].true_sigma_t * column);
    part.beam[c] = std::exp(-optics_[c].sigma_t_beam * beam_column);
  }
  return part;
}

}  // namespace vdb_diffuse
