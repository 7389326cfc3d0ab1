#pragma once

#include <memory>

#include "blobs/system.h"

namespace vdb_diffuse {

struct BlobSolveReport {
  double condition_number = 0;  ///< of the system scaled to a unit diagonal, an estimate; infinite: singular
  bool regularised = false;
  bool converged = true;
  int iterations = 0;  ///< 1 where solved at once
  double relative_residual = 0;
};

/// A system made ready for any number of right-hand sides. Up to `kDenseBlobs`, and for collocation always,
/// by a dense LU; above by conjugate gradients. One whose condition number is above `kWorstCondition` gets a
/// multiple of its diagonal added until it is not, and one on which conjugate gradients stall as well.
class BlobSolver {
 public:
  BlobSolver(const BlobSystem& system, BlobForm form);
  ~BlobSolver();
  std::vector<double> solve(const std::vector<double>& b, double tolerance, BlobSolveReport& report) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

constexpr int kDenseBlobs = 600;
/// Beyond it a float's worth of error in the coefficients is all of the answer.
constexpr double kWorstCondition = 1e7;

}  // namespace vdb_diffuse
