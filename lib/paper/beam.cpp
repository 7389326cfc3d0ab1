#include "paper/beam.h"

#include <cmath>

#include "paper/part.h"

namespace vdb_diffuse {

PlaneMedium beamMedium(const BeamCase& beam, int cells) {
  PlaneMedium m;
  m.grid = {cells, cells, 1.0 / cells};
  m.rho.assign(m.grid.count(), 1.0);
  m.sigma_s = beam.albedo * beam.tau;
  m.sigma_a = (1 - beam.albedo) * beam.tau;
  m.g = beam.g;
  for (int i = 0; i < cells; ++i)
    m.irradiance.push_back(std::abs((i + 0.5) / cells - 0.5) < 0.5 * kBeamWidth ? 1 : 0);
  return m;
}

BeamLight lightOfBeam(const BeamCase& beam, const PaperSettings& settings) {
  BeamLight light;
  light.beam = beam;
  light.medium = beamMedium(beam);
  VCycleSettings v;
  v.relaxations = settings.relaxations;
  v.depth = settings.depth;
  v.tolerance = 1e-5;
  v.progress = settings.progress;
  solveByVCycles(formPlaneSystem(light.medium, PlaneForm::kPrinted), light.printed, v);
  light.report = solveByVCycles(formPlaneSystem(light.medium, PlaneForm::kCorrected), light.corrected, v);
  PlaneTracerSettings tracer;
  tracer.paths = static_cast<uint64_t>(settings.effort * (1 << 19));
  tracer.block = kBeamBlock;
  tracer.progress = settings.progress;
  light.truth = tracePlane(light.medium, tracer);
  const PlaneField even(light.truth.I0.size(), 1.0);
  const auto error = [&](const PlaneField& I0) {
    return relativeRms(blockMeans(light.medium.grid, I0, kBeamBlock), light.truth.I0, even,
                       light.truth.I0_se);
  };
  light.printed_error = error(light.printed);
  light.corrected_error = error(light.corrected);
  return light;
}

}  // namespace vdb_diffuse
