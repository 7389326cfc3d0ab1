#pragma once

#include <cstdint>

#include "grid/progress.h"
#include "plane/plane.h"

namespace vdb_diffuse {

/// The light in the plane by Monte Carlo: directions in space, positions in the plane, free flights by delta
/// tracking (Woodcock 1965), Henyey and Greenstein's phase function. Every tentative collision of light that
/// has scattered adds its weight over the majorant to the mean intensity of its block. No approximation but
/// noise.
struct PlaneTracerSettings {
  uint64_t paths = 1 << 18;
  int block = 8;  ///< cells to a side of what is tallied; the grid's sides are multiples
  uint64_t seed = 1;
  Progress progress;
};

struct PlaneTracerResult {
  PlaneGrid grid;          ///< of the blocks
  PlaneField I0, I0_se;    ///< mean intensity of light that has scattered, and its standard error
  PlaneField reflected;    ///< W/m2 of scattered light out of row 0, by column of blocks
  PlaneField transmitted;  ///< likewise out of the last row
  double reflectance = 0, reflectance_se = 0;      ///< over the power that comes in
  double transmittance = 0, transmittance_se = 0;  ///< of scattered light
  /// sqrt(sum w I0_se^2 / sum w I0^2).
  double noise(const PlaneField& weight) const;
  double absorbed = 0, sideways = 0, unscattered = 0;  ///< of the power that comes in
};

/// The same bits for any number of threads.
PlaneTracerResult tracePlane(const PlaneMedium& medium, const PlaneTracerSettings& settings);

}  // namespace vdb_diffuse
