#pragma once

#include "plot/chart.h"
#include "report/measurement.h"

namespace vdb_diffuse {

/// What the picture says beside its points.
struct FigureWords {
  std::string title, subtitle;
  int block = 1;     ///< width of the blocks that the errors are of
  double noise = 0;  ///< of the truth on such blocks, as a fraction; 0: not known
};

/// Error against seconds, both logarithmic: Monte Carlo as a curve with its law, the other methods as points,
/// the truth's noise as a band, and an arrow from the method called `featured` to Monte Carlo at the same
/// error. Rows whose error is not positive and finite cannot be shown and are left out.
Chart figureOf(const std::vector<Measurement>& rows, const FigureWords& words,
               const std::string& featured = "default");

}  // namespace vdb_diffuse
