#include "io/image.h"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "grid/error.h"
#include "io/whole_file.h"

namespace vdb_diffuse {
namespace {

/// IEC 61966-2-1, of a linear value 0..1.
double srgb(double v) {
  return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
}

uint8_t byteOf(double v) {
  return static_cast<uint8_t>(std::lround(255 * std::clamp(v, 0.0, 1.0)));
}

}  // namespace

void writePng(const std::string& path, const Image& image, double exposure, const std::vector<float>* alpha) {
  const double factor = std::exp2(exposure);
  const int channels = alpha ? 4 : 3;
  std::vector<uint8_t> pixels;
  pixels.reserve(image.pixels.size() * channels);
  for (size_t i = 0; i < image.pixels.size(); ++i) {
    const double opacity = alpha ? std::clamp((*alpha)[i], 0.0f, 1.0f) : 1;
    const double straight = opacity > 0 ? factor / opacity : 0;
    for (int c = 0; c < 3; ++c)
      pixels.push_back(byteOf(srgb(std::clamp(image.pixels[i][c] * straight, 0.0, 1.0))));
    if (alpha) pixels.push_back(byteOf(opacity));
  }

  png_image png = {};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = alpha ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
  // Encoded in memory, so that a full disk is met by one checked write.
  std::string bytes(PNG_IMAGE_PNG_SIZE_MAX(png), '\0');
  png_alloc_size_t size = bytes.size();
  if (!png_image_write_to_memory(&png, bytes.data(), &size, 0, pixels.data(), 0, nullptr)) {
    const std::string why = png.message;
    png_image_free(&png);
    throw OutputError(path + ": the PNG could not be encoded: " + why);
  }
  bytes.resize(size);
  writeWholeFile(path, bytes);
}

}  // namespace vdb_diffuse
