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

void drawColourBar(Canvas& canvas, const Box& box, const ColourMap& map, const std::string& low,
                   const std::string& high) {
  for (int x = 0; x < static_cast<int>(box.width); ++x)
    canvas.area({{box.left + x, box.top},
                 {box.left + x + 1, box.top},
                 {box.left + x + 1, box.bottom()},
                 {box.left + x, box.bottom()}},
                colourOf(map, (x + 0.5) / box.width));
  TextStyle style{14, {0.15, 0.15, 0.15}};
  canvas.text(low, {box.left, box.bottom() + 18}, style);
  style.x = AlignX::kRight;
  canvas.text(high, {box.right(), box.bottom() + 18}, style);
}

}  // namespace vdb_diffuse
