#pragma once

#include "blobs/solver.h"
#include "diffusion/diffuse.h"

namespace vdb_diffuse {

struct BlobSettings {
  int count = 200;  ///< of blobs that are fitted; at most one for eight voxels, see also fitBlobs
  BlobForm form = BlobForm::kGalerkin;
  bool source_at_centres = false;  ///< look for light at the blobs' centres alone, as the paper does
  bool want_direct = true;         ///< with `source_at_centres`: in every voxel all the same
  std::optional<double> overlap;   ///< factor on the fitted sizes; unset: `overlapOf` the form
};

/// Gaussians fitted to the density touch each other only in their flanks, and light that is a sum of them has
/// steps. Wider ones are smooth and ill-conditioned. Of factors from 0.8 to 6, three left the smallest error
/// with Galerkin on a cloud of 100,000 voxels (19 % instead of 52 % with one), and two with collocation (44
/// %).
inline double overlapOf(BlobForm form) {
  return form == BlobForm::kGalerkin ? 3 : 2;
}

struct BlobReport {
  size_t blobs = 0;             ///< that were fitted
  double condition_number = 0;  ///< of the worst channel's system; 0: no system was solved
  double seconds_fit = 0;
};

/// The diffuse light in a medium by Stam's blob finite elements (section 4.2): the same equation as `diffuse`
/// solves, for light that is a sum over some hundred or thousand blobs instead of one value for every voxel.
/// Of `settings`, those about multigrid and transport have no meaning. `seconds_setup` has what depends on
/// the medium alone, the fit too; `seconds_solve` what another light costs.
DiffuseResult blobLight(const Medium& medium, const Scene& scene, const DiffuseSettings& settings,
                        const BlobSettings& blobs, BlobReport* report = nullptr);

/// Most blobs that dense collocation takes, and most of all.
constexpr int kMostCollocated = 2000, kMostBlobs = 10000;

}  // namespace vdb_diffuse
