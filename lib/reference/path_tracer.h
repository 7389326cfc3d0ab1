#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "grid/progress.h"
#include "medium/medium.h"
#include "scene/scene.h"

namespace vdb_diffuse {

/// The referee: the light inside a medium by Monte Carlo, without any approximation of the transport
/// equation in voxels of constant density, so that its error is the noise that it reports. It shares no
/// method with the solver.
///
/// Paths start at the lights. Light that has not collided is followed through the whole volume, its
/// attenuation being known; the first collision is then drawn along the ray and carries what was lost there.
/// From there on light takes free flights between collisions. Every stretch l of a path of power w adds
/// w l / (4 pi V) to the mean intensity of the voxel, of volume V, that it crosses (track-length estimator;
/// Lux and Koblinger, "Monte Carlo Particle Transport Methods" (1991), 6.II).
///
/// What stands behind the words: a sun is a disc of even radiance; a point light with a radius is a ball
/// whose surface shines outward with even radiance, and which hides nothing; a dome's image is constant in
/// each pixel. Surfaces are Lambertian on both sides, for any number of bounces.
struct ReferenceSettings {
  uint64_t samples = 0;  ///< paths, 0: no limit
  double noise = 0;      ///< stop at this relative noise per voxel (Norms::noise of `diffuse`), 0: no limit
  double seconds = 0;    ///< wall clock, 0: no limit
  uint64_t seed = 1;
  bool want_flux = false;
  uint64_t max_bytes = 0;  ///< batches in flight are fewer where more would not fit; 0: no limit
  Progress progress;
};

/// Powers in W (grey, or luminance where coloured), of the light that has scattered. What a surface absorbs
/// has escaped. Every path's power is accounted for, so that the closure is rounding unless power was lost.
struct ReferenceEnergy {
  double scattered_in = 0, emitted = 0, absorbed = 0, escaped = 0;
  double lost = 0;  ///< of paths that were given up after `kMostScatterings`; 0 unless a warning says so
  double closure() const {
    const double in = scattered_in + emitted;
    return in > 0 ? (in - absorbed - escaped) / in : 0;
  }
};

struct ReferenceResult {
  Channels diffuse;     ///< I_d0: mean over directions of the light that has scattered, W/m2/sr
  Channels direct;      ///< I_ri0: of the light that has not; surfaces may have reflected it
  Channels diffuse_se;  ///< standard error of `diffuse`, from the spread of independent batches
  VectorField flux;     ///< int I_d s dw in world axes, W/m2, luminance where coloured; only if wanted
  uint64_t samples = 0, scatterings = 0, batches = 0;
  double noise = 0;  ///< sqrt(sum diffuse_se^2 / sum diffuse^2) over active voxels and channels
  /// Noise of the means of 2^3, 4^3 and 8^3 voxels over what it were if voxels erred independently of each
  /// other, >= 1 or about: a path crosses many voxels.
  std::array<double, 3> correlation{1, 1, 1};
  double seconds = 0;
  ReferenceEnergy energy;
  std::vector<std::string> warnings;
};

/// A path is given up after so many scatterings, for time must end; its power is then counted as lost and a
/// warning says how much. Light that enters a conservative medium scatters about as often on the average as
/// the medium is deep in mean free paths, and the square of that at most, so that depths up to some thousand
/// never come near.
constexpr uint64_t kMostScatterings = 10'000'000;

/// Relative noise at which to stop where the settings give no limit at all.
constexpr double kUsualNoise = 0.02;

/// The same bits for any number of threads, as long as `seconds` is not what ended it. Where several limits
/// are given, the first that is met ends it.
/// \throws Interrupted from `progress`; InputError where not even one batch fits in `max_bytes`
ReferenceResult reference(const Medium& medium, const Scene& scene, const ReferenceSettings& settings = {});

}  // namespace vdb_diffuse
