#include "report/error_curve.h"

#include <cmath>

namespace vdb_diffuse {

std::optional<EqualError> secondsForError(const std::vector<CurvePoint>& curve, double error) {
  if (curve.empty() || !(error > 0)) return std::nullopt;
  const auto byLaw = [&](const CurvePoint& p) { return p.seconds * (p.error / error) * (p.error / error); };
  if (curve.back().error > error) return EqualError{byLaw(curve.back()), true};
  for (size_t i = curve.size() - 1; i > 0; --i) {
    const CurvePoint &above = curve[i - 1], &below = curve[i];
    if (above.error < error) continue;
    const double part =
        above.error == below.error ? 1 : std::log(above.error / error) / std::log(above.error / below.error);
    return EqualError{above.seconds * std::pow(below.seconds / above.seconds, part), false};
  }
  const bool reached = curve.front().error == error;
  return EqualError{reached ? curve.front().seconds : byLaw(curve.front()), !reached};
}

double lawOf(const std::vector<CurvePoint>& curve) {
  return curve.empty() ? 0 : curve.back().error * std::sqrt(curve.back().seconds);
}

}  // namespace vdb_diffuse
