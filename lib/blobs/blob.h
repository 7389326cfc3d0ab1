#pragma once

#include <cmath>
#include <vector>

#include "grid/transform.h"

namespace vdb_diffuse {

/// One blob of Stam (1995) section 4.2, in the grid's frame: along the grid's axes, in mean voxel sizes, from
/// the centre of the topology's lowest voxel.
struct Blob {
  Vec3d centre{0, 0, 0};
  double sigma = 1;  ///< of the Gaussian, > 0
  double mass = 0;   ///< of density, sum of rho over voxels
};

/// Where a blob ends, in sigmas.
constexpr double kBlobReach = 3;

/// The Gaussian, brought to zero at its reach so that systems are sparse:
///
///     G(q) = exp(-q/2) (1 - (q/reach^2)^2)^2,     q = r^2 / sigma^2
///
/// once continuously differentiable. Its peak is 1.
struct BlobKernel {
  double value, slope, curvature;  ///< G, dG/dq, d2G/dq2
};

inline BlobKernel blobKernel(double q) {
  constexpr double k = 1 / (kBlobReach * kBlobReach);
  const double s = k * q, t = 1 - s * s, dt = -2 * k * s;
  if (t <= 0) return {0, 0, 0};
  const double e = std::exp(-0.5 * q);
  return {e * t * t, e * t * (2 * dt - 0.5 * t), e * (t * (0.25 * t - 2 * dt - 4 * k * k) + 2 * dt * dt)};
}

/// Integral of G over space, in sigma^3; see Blobs.KernelIntegralIsWhatItSays.
constexpr double kBlobIntegral = 11.786614;

/// What a blob weighs at its centre: its density, but for the factor 1/kBlobIntegral.
inline double blobPeak(const Blob& blob) {
  return blob.mass / (blob.sigma * blob.sigma * blob.sigma);
}

}  // namespace vdb_diffuse
