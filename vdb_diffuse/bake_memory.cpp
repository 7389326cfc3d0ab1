#include "bake.h"
#include "diffusion/mean_depth.h"
#include "io/free_memory.h"
#include "medium/coarse_medium.h"

namespace vdb_diffuse {

double bakeBytes(const BakeFlags& flags, const Medium& medium) {
  const bool flux = flags.wants("flux"), sweeps = sweepsOf(flags) > 0;
  const bool anisotropic = medium.optics.g != 0;
  // of the densest channel, unless the model is told to do without
  ChannelOptics optics = channelOptics(medium, 0, Model::kDefault);
  for (int c = 1; c < 3; ++c)
    if (channelOptics(medium, c, Model::kDefault).sigma_t_beam > optics.sigma_t_beam)
      optics = channelOptics(medium, c, Model::kDefault);
  const bool thick = flags.model == "default" && mostDepth(medium, optics) > kThinVoxel;
  constexpr double kShape =
      6;  // where in its voxels a beam scatters; given back before a solve without sweeps
  const double per_channel = (thick && (sweeps || flux) ? kShape : 0) + 2 + (medium.optics.g > 0 ? 1 : 0) +
                             (anisotropic || flux ? 3 : 0) + (flux ? 3 : 0);
  constexpr double kSolve =
      13;  // r, p, q, z, w, b, x in double, operator of the finest level and the coarse ones
  constexpr double kSweep = 16;    // depth, source and its slopes, mean, divergence, correction and its solve
  constexpr double kSlopes = 6;    // of light that sweeps find in thick voxels
  constexpr double kThick = 4;     // for the right-hand side, and for what faces send each other
  constexpr double kMoments = 25;  // of source, light and beams
  // the density that rescaled beams meet
  const double beam_density =
      medium.optics.g > 0 && !medium.albedo.empty() ? (medium.greyOptics() ? 1 : 3) : 0;
  const double fields = 1 + medium.emission.size() + medium.albedo.size() + beam_density + 3 * per_channel +
                        (flux ? 6 : 0) + kSolve +
                        (sweeps ? kSweep + (anisotropic ? kMoments : 0) + (thick ? kSlopes : 0) : 0) +
                        (thick ? kThick : 0);
  return fields * sizeof(float) * kBlockVoxels * medium.topology().blockCount();
}

constexpr int kMostCoarsening = 4;

int coarsenToFit(const BakeFlags& flags, Medium& medium) {
  const bool fit = flags.coarsen == "auto";
  const int wanted = fit ? 0 : std::stoi(flags.coarsen);
  int times = 0;
  double need = 0, free = 0;
  while (true) {
    need = bakeBytes(flags, medium);
    free = static_cast<double>(freeMemory());
    if (times >= wanted && (need <= free || !fit || times == kMostCoarsening)) break;
    medium = coarsened(medium);
    ++times;
  }
  if (need <= free) return times;
  constexpr double kGiB = 1024.0 * 1024 * 1024;
  char line[200];
  std::snprintf(line, sizeof line, ": baking it may take %.3g GiB and %.3g GiB are free; %s", need / kGiB,
                free / kGiB, fit ? "clip it" : "--coarsen auto solves it in larger voxels");
  throw InputError(flags.input + line);
}

}  // namespace vdb_diffuse
