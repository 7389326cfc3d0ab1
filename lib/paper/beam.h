#pragma once

#include "plane/plane_equation.h"
#include "plane/plane_tracer.h"
#include "plane/v_cycle.h"

namespace vdb_diffuse {

/// Section 5.1: a square of constant density, a beam through the middle of its first row.
struct BeamCase {
  double albedo = 0.99, tau = 20, g = 0;  ///< tau: optical depth of the square; the paper's mu_bar is 3 g

  bool operator==(const BeamCase& o) const { return albedo == o.albedo && tau == o.tau && g == o.g; }
};

constexpr double kBeamWidth = 1.0 / 8;  ///< of the square

PlaneMedium beamMedium(const BeamCase& beam, int cells = 512);

/// A case by the two forms and by Monte Carlo, the latter on blocks.
struct BeamLight {
  BeamCase beam;
  PlaneMedium medium;
  PlaneField printed, corrected;                  ///< by cell
  PlaneTracerResult truth;                        ///< by block of `kBeamBlock`^2 cells
  VCycleReport report;                            ///< of the corrected form
  double printed_error = 0, corrected_error = 0;  ///< relative RMS over the blocks, the noise taken off

  double noise() const { return truth.noise(PlaneField(truth.I0.size(), 1.0)); }
};
constexpr int kBeamBlock = 8;

struct PaperSettings;
BeamLight lightOfBeam(const BeamCase& beam, const PaperSettings& settings);

}  // namespace vdb_diffuse
