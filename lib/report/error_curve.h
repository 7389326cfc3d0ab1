#pragma once

#include <optional>
#include <vector>

namespace vdb_diffuse {

/// Error against time of a method that can be given more of it, as Monte Carlo, whose error falls as
///
///     error = c / sqrt(seconds)
///
/// once its samples are many and nothing else takes time.
struct CurvePoint {
  double seconds = 0;  ///< > 0
  double error = 0;    ///< > 0
};

struct EqualError {
  double seconds = 0;         ///< that the curve takes to reach the error
  bool extrapolated = false;  ///< by the law, beyond the points
};

/// When a curve, its points in the order of time, comes down to an error for good. Between two points it is
/// straight on logarithmic axes; before the first and after the last it follows the law. Nothing for a curve
/// without points or an error that is not positive.
std::optional<EqualError> secondsForError(const std::vector<CurvePoint>& curve, double error);

/// The c of the law through the last point, where samples are most; 0 without points.
double lawOf(const std::vector<CurvePoint>& curve);

}  // namespace vdb_diffuse
