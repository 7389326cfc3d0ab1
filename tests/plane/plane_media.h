#pragma once

#include "plane/plane.h"

namespace vdb_diffuse {

/// A layer of density 1 and thickness 1 in nx x ny cells; columns from `first` to before `end` are lit.
inline PlaneMedium layerMedium(int nx, int ny, double tau, double albedo, double g, int first, int end) {
  PlaneMedium m;
  m.grid = {nx, ny, 1.0 / ny};
  m.rho.assign(m.grid.count(), 1.0);
  m.sigma_s = albedo * tau;
  m.sigma_a = (1 - albedo) * tau;
  m.g = g;
  for (int i = 0; i < nx; ++i) m.irradiance.push_back(i >= first && i < end ? 1 : 0);
  return m;
}

}  // namespace vdb_diffuse
