#pragma once

#include <memory>

#include "reference/path_tracer.h"

namespace vdb_diffuse {

/// What one batch of paths leaves in the voxels: power times length in units of h. A voxel's record holds the
/// density and, for each channel, the light that has scattered; records stand as recordOffset() says. Floats
/// do: a batch is small enough for its sums to stay far from 2^24 times their terms.
struct BatchTally {
  std::vector<float> records;
  std::vector<float> direct;  ///< channels of a voxel together, in the same order
  std::vector<float> flux;    ///< likewise three numbers, along the grid's axes; empty unless wanted
  ReferenceEnergy energy;     ///< in units of power of the paths
  uint64_t scatterings = 0, given_up = 0;
  uint64_t ray_voxels = 0, walk_voxels = 0, walks = 0;  ///< the work that it took
};

/// Sums over batches. A batch of n paths gives each voxel an estimate m; batches may differ in size, and with
/// variance s^2 / n for each,
///
///     mean     sum n m / N                             N = sum n, K batches
///     s^2      sum n (m - mean)^2 / (K - 1)            as E sum n (m - mean)^2 = (K - 1) s^2
///     se^2     s^2 / N
///
/// which takes sum n m and sum n m^2 only. A path crosses many voxels, so neighbours' errors go together; the
/// same two sums are kept for cells of 2^3, 4^3 and 8^3 voxels, to tell by how much.
class Tally {
 public:
  Tally(const Medium& medium, int channels, bool flux);

  int channels() const { return channels_; }
  bool wantsFlux() const { return !flux_.empty(); }
  std::unique_ptr<BatchTally> newBatch() const;
  /// As new, for another batch.
  void clear(BatchTally& batch) const;
  static double bytesPerBatch(const Topology& topology, int channels, bool flux);
  static double bytesOfSums(const Topology& topology, int channels, bool flux);

  /// A batch's numbers are n times its estimate.
  void add(const BatchTally& batch, uint64_t n);

  uint64_t paths() const { return paths_; }
  uint64_t batches() const { return batches_; }
  /// sqrt(sum se^2 / sum mean^2) over active voxels and channels; 0 where all is dark.
  double noise() const { return noise_; }

  /// Means in W/m2/sr from powers in units of `unit`, in W. Frees the sums.
  void finish(double unit, ReferenceResult& result);

 private:
  const Medium& medium_;
  int channels_;
  std::vector<double> diffuse_, square_, direct_, flux_;
  std::vector<double> cells_, cell_squares_;  // kCells for each block and channel, the small ones first
  static constexpr int kCells = 64 + 8 + 1;
  ReferenceEnergy energy_;
  uint64_t paths_ = 0, batches_ = 0, scatterings_ = 0, given_up_ = 0;
  double noise_ = 0;

  void findCorrelation(ReferenceResult& result) const;
};

}  // namespace vdb_diffuse
