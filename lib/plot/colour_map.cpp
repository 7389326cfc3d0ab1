#include "plot/colour_map.h"

#include <algorithm>
#include <cmath>

namespace vdb_diffuse {

Colour colourOf(const ColourMap& map, double share) {
  if (!std::isfinite(share)) return {0, 0.8, 0};
  const double x = std::clamp(share, 0.0, 1.0) * (map.size() - 1);
  const size_t n = std::min(static_cast<size_t>(x), map.size() - 2);
  const double t = x - static_cast<double>(n);
  const auto mix = [&](double a, double b) { return a + t * (b - a); };
  return {mix(map[n].red, map[n + 1].red), mix(map[n].green, map[n + 1].green),
          mix(map[n].blue, map[n + 1].blue)};
}

}  // namespace vdb_diffuse
