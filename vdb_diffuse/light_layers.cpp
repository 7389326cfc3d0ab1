#include "light_layers.h"

#include <cmath>
#include <utility>

#include "plot/canvas.h"

namespace vdb_diffuse {
namespace {

/// The transfer function of IEC 61966-2-1.
double screenValue(double x) {
  return x <= 0.0031308 ? 12.92 * std::max(x, 0.0) : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
}

std::vector<Colour> screenColours(const Image& image, double exposure) {
  const double factor = std::exp2(exposure);
  std::vector<Colour> colours;
  colours.reserve(image.pixels.size());
  for (const Vec3f& p : image.pixels)
    colours.push_back({screenValue(p[0] * factor), screenValue(p[1] * factor), screenValue(p[2] * factor)});
  return colours;
}

}  // namespace

LightLayers renderLayers(LitVolume& lit, const Camera& camera, const RenderSettings& settings,
                         const Progress& progress) {
  LightLayers layers;
  layers.both = render(lit, camera, settings, progress);
  Channels diffuse = std::exchange(lit.diffuse, {}), glow = std::exchange(lit.medium.emission, {});
  VectorField flux = std::exchange(lit.flux, {});
  layers.direct = render(lit, camera, settings, progress).radiance;
  lit.diffuse = std::move(diffuse);
  lit.medium.emission = std::move(glow);
  lit.flux = std::move(flux);
  layers.diffuse = layers.both.radiance;
  for (size_t i = 0; i < layers.diffuse.pixels.size(); ++i)
    layers.diffuse.pixels[i] -= layers.direct.pixels[i];
  return layers;
}

std::string contactSheet(const LightLayers& layers, double exposure, const Vec3d& background) {
  constexpr int kGap = 8, kHeader = 34;
  const int width = layers.direct.width, height = layers.direct.height;
  Canvas canvas(PictureFormat::kPng, 3 * width + 4 * kGap, height + kHeader + kGap);
  const std::pair<const char*, Image> panels[] = {
      {"direct", layers.direct}, {"diffuse", layers.diffuse}, {"both", over(layers.both, background)}};
  double left = kGap;
  for (const auto& [name, image] : panels) {
    canvas.text(name, {left, kHeader - 12}, TextStyle{16, {0.15, 0.15, 0.15}, true});
    canvas.pixels({left, kHeader, static_cast<double>(width), static_cast<double>(height)}, width, height,
                  screenColours(image, exposure));
    left += width + kGap;
  }
  return canvas.finish();
}

}  // namespace vdb_diffuse
