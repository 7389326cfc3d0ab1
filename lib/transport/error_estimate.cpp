#include "transport/error_estimate.h"

#include <algorithm>
#include <cmath>

namespace vdb_diffuse {

double ErrorEstimate::afterStep(double change) {
  constexpr double kUsualPart = 0.4;  // of the first step, before there are two to compare
  constexpr double kLeastPart = 0.2, kMostPart = 0.9;
  const double part = last_ && *last_ > 0 ? std::clamp(change / *last_, kLeastPart, kMostPart) : kUsualPart;
  last_ = change;
  return std::hypot(change * part / (1 - part), floor_);
}

}  // namespace vdb_diffuse
