#pragma once

#include <gtest/gtest.h>
#include <png.h>

#include <array>
#include <string>
#include <vector>

namespace vdb_diffuse {

struct PngPixels {
  int width = 0, height = 0;
  std::vector<unsigned char> rgb;

  std::array<int, 3> at(int x, int y) const {
    const size_t i = 3 * (static_cast<size_t>(y) * width + x);
    return {rgb[i], rgb[i + 1], rgb[i + 2]};
  }
};

/// A PNG file's bytes, on black where it is transparent.
inline PngPixels pixelsOf(const std::string& bytes) {
  PngPixels pixels;
  png_image png = {};
  png.version = PNG_IMAGE_VERSION;
  EXPECT_TRUE(png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()));
  png.format = PNG_FORMAT_RGB;
  pixels.width = static_cast<int>(png.width);
  pixels.height = static_cast<int>(png.height);
  pixels.rgb.resize(PNG_IMAGE_SIZE(png));
  const png_color black = {0, 0, 0};
  EXPECT_TRUE(png_image_finish_read(&png, &black, pixels.rgb.data(), 0, nullptr));
  return pixels;
}

}  // namespace vdb_diffuse
