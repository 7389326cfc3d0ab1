#include <algorithm>
#include <cmath>

#include "render/render.h"

namespace vdb_diffuse {

Image over(const Picture& picture, const Vec3d& background) {
  Image image = picture.radiance;
  for (size_t i = 0; i < image.pixels.size(); ++i)
    for (int c = 0; c < 3; ++c)
      image.pixels[i][c] += static_cast<float>(background[c] * picture.transmittance[i][c]);
  return image;
}

std::vector<float> opacity(const Picture& picture) {
  std::vector<float> alpha(picture.transmittance.size());
  std::transform(picture.transmittance.begin(), picture.transmittance.end(), alpha.begin(),
                 [](const Vec3f& t) { return std::clamp(1 - (t[0] + t[1] + t[2]) / 3, 0.0f, 1.0f); });
  return alpha;
}

double automaticExposure(const Image& image) {
  constexpr double kPercentile = 0.99, kNearWhite = 0.8;
  std::vector<double> lit;
  for (const Vec3f& pixel : image.pixels)
    if (const double l = luminance(Vec3d(pixel)); l > 0) lit.push_back(l);
  if (lit.empty()) return 0;
  const auto nth =
      lit.begin() + static_cast<std::ptrdiff_t>(kPercentile * static_cast<double>(lit.size() - 1));
  std::nth_element(lit.begin(), nth, lit.end());
  return std::log2(kNearWhite / *nth);
}

}  // namespace vdb_diffuse
