#pragma once

#include <cstdint>
#include <optional>

#include "grid/norms.h"
#include "report/error_curve.h"
#include "report/method.h"

namespace vdb_diffuse {

/// What every method is held against: a grid of `diffuse` with its standard error, on the medium's voxels.
struct Truth {
  GridValues diffuse, standard_error;
  std::optional<GridValues> direct;  ///< of a stored one, if it has it
  bool noisy = true;                 ///< the standard error is known
  uint64_t seed = 0;                 ///< that it was made with; 0: not known
  GridValues density;                ///< the weight of the error norms
  Norms norms(int block) const;      ///< of which the noise counts
};

/// Errors of one grid over the density-weighted volume, the truth's noise taken off.
struct Errors {
  Norms voxels;   ///< of single voxels
  Norms blocks4;  ///< of averages over 4^3 voxels
  Norms blocks;   ///< of averages over blocks of the chosen width
};

/// A row of the report.
struct Measurement {
  std::string quantity = "diffuse", method, setting, label, series;
  double seconds = 0;  ///< wall clock, without reading and writing
  int repeats = 1;     ///< of which the seconds are the median
  Errors errors;
  uint64_t samples = 0;           ///< of Monte Carlo
  std::optional<int> iterations;  ///< of a solve
  bool converged = true;
  std::optional<double> closure;          ///< of the energy
  std::optional<double> estimated_error;  ///< what the method says of itself
  size_t negative_voxels = 0;
  std::optional<EqualError> monte_carlo;  ///< its time to the same error
  std::vector<std::string> warnings;
};

struct MeasureSettings {
  int block = 1;            ///< width of the blocks in `Errors::blocks`, voxels
  double tolerance = 1e-4;  ///< of the solves
  int repeats = 3;          ///< of what takes less than `kLong`; what takes longer is done once
  Progress progress;
};

constexpr double kLong = 5;  ///< seconds after which one run tells enough

/// Grids on the medium's voxels as `compareGrids` takes them.
GridValues gridValues(const Medium& medium, Channels channels);

Measurement measure(const Method& method, const Medium& medium, const Scene& scene, const Truth& truth,
                    const MeasureSettings& settings);

/// How much brighter, as a fraction, this scene's direct light is than another's in `direct`: far from zero
/// where the lights are not the same.
double directExcess(const Medium& medium, const Scene& scene, const GridValues& direct,
                    const GridValues& density, const Progress& progress);

/// The first scatter by sweeps along beams and by the exact march: seconds of each, and how far each is from
/// the other, in `direct`. The two rows are called "beams" and "march".
std::vector<Measurement> measureFirstScatter(const Medium& medium, const Scene& scene, const Truth& truth,
                                             const MeasureSettings& settings);

struct MonteCarloSettings {
  uint64_t seed = 1000001;  ///< of the first run; the next ones count on, past the truth's own
  uint64_t max_bytes = 0;   ///< for batches in flight; 0: no limit
  double seconds = 60;      ///< no run is begun that would take longer
};

/// Monte Carlo at 4 times as many samples each time, until its error comes near the truth's own noise.
/// The first run has about one path for 256 voxels, which in most volumes is an error near one.
std::vector<Measurement> measureMonteCarlo(const Medium& medium, const Scene& scene, const Truth& truth,
                                           const MeasureSettings& settings,
                                           const MonteCarloSettings& monte_carlo = {});

/// Fills in, for every other method, what Monte Carlo needs for the same error on the chosen blocks.
void compareWithMonteCarlo(std::vector<Measurement>& rows);

/// The rows of Monte Carlo as a curve, for errors on the chosen blocks.
std::vector<CurvePoint> monteCarloCurve(const std::vector<Measurement>& rows);

}  // namespace vdb_diffuse
