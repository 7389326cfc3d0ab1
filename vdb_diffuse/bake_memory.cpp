#include "bake.h"
#include "io/free_memory.h"
#include "medium/coarse_medium.h"

namespace vdb_diffuse {

double bakeBytes(const BakeFlags& flags, const Medium& medium) {
  const bool flux = flags.wants("flux"), sweeps = sweepsOf(flags) > 0;
  const bool anisotropic = medium.optics.g != 0;
  const double per_channel =
      2 + (medium.optics.g > 0 ? 1 : 0) + (anisotropic || flux ? 3 : 0) + (flux ? 3 : 0);
  constexpr double kSolve =
      13;  // r, p, q, z, w, b, x in double, operator of the finest level and the coarse ones
  constexpr double kSweep = 16;    // depth, source and its slopes, mean, divergence, correction and its solve
  constexpr double kMoments = 25;  // of source, light and beams
  // the density that rescaled beams meet
  const double beam_density =
      medium.optics.g > 0 && !medium.albedo.empty() ? (medium.greyOptics() ? 1 : 3) : 0;
  const double fields = 1 + medium.emission.size() + medium.albedo.size() + beam_density + 3 * per_channel +
                        (flux ? 6 : 0) + kSolve + (sweeps ? kSweep + (anisotropic ? kMoments : 0) : 0);
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
