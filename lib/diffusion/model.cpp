#include "diffusion/model.h"

#include <cmath>
#include <limits>

namespace vdb_diffuse {

ChannelOptics channelOptics(const Optics& optics, int channel, Model model, int phase_order) {
  ChannelOptics c;
  const double g = optics.g;
  c.true_sigma_s = optics.sigma_s[channel];
  c.sigma_a = optics.sigma_a[channel];
  c.true_sigma_t = c.true_sigma_s + c.sigma_a;
  c.sigma_tr = c.sigma_a + (1 - g) * c.true_sigma_s;
  const bool rescale = model == Model::kDefault && g > 0;
  const double f = !rescale ? 0 : phase_order == 2 ? g * g * g : g * g;
  c.sigma_s = (1 - f) * c.true_sigma_s;
  c.g = (g - f) / (1 - f);
  if (phase_order == 2) c.p2 = (g * g - f) / (1 - f);
  c.sigma_t_beam = rescale ? c.sigma_a + c.sigma_s : c.true_sigma_t;
  c.source_sigma = model == Model::kPaper ? c.true_sigma_t : c.sigma_s;
  c.flux_factor = model == Model::kPaper ? 3 : 1;
  c.true_g = g;
  return c;
}

ChannelOptics channelOptics(const Medium& medium, int channel, Model model, int phase_order) {
  ChannelOptics c = channelOptics(medium.optics, channel, model, phase_order);
  c.albedo_field = medium.albedoIn(channel);
  return c;
}

double meanFreePathCap(const ModelSettings& settings, const Medium& medium) {
  if (settings.mean_free_path_cap) return *settings.mean_free_path_cap;
  if (settings.model != Model::kDefault) return std::numeric_limits<double>::infinity();
  const double count = static_cast<double>(medium.topology().activeVoxelCount());
  return 0.5 * medium.transform().meanVoxelSize() * std::cbrt(count);
}

}  // namespace vdb_diffuse
