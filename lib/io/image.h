#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "scene/scene.h"

namespace vdb_diffuse {

/// Pictures in and out. EXR carries radiometric values untouched, PNG a view of them for a screen. Files that
/// come in are not trusted; a file that goes out appears whole or not at all, and a failure leaves an older
/// file of that name as it was.

/// Largest picture that is read: 16384 x 8192, a common upper end of sky maps, 1.6 GB as floats.
constexpr long long kMaxImagePixels = 1LL << 27;

/// A single-part EXR with R, G, B or with Y alone, half or float. The data window must be the display window.
/// \throws InputError for what is not a regular file, is deep, multi-part, truncated, too large or too small
///         for its data window, or holds NaN, infinite or negative pixels (their count and the first are
///         named)
Image readExr(const std::string& path);

struct ExrOptions {
  bool half = false;  ///< 16-bit pixels; values above 65504 are stored as 65504
  const std::vector<float>* alpha =
      nullptr;  ///< one per pixel, 0..1, the colours being premultiplied; none: RGB
  std::map<std::string, std::string> attributes;  ///< text beside the picture, by name
  /// More pictures of the same size, with channels NAME.R, NAME.G and NAME.B: a compositor's layers.
  std::vector<std::pair<std::string, const Image*>> layers = {};
};

/// \throws OutputError
void writeExr(const std::string& path, const Image& image, const ExrOptions& options = {});

/// 8 bits per channel with the sRGB transfer function, after a factor 2^exposure; what is then above 1 is 1.
/// \param alpha  one per pixel, 0..1, the colours being premultiplied: the PNG then holds straight alpha,
/// which
///               cannot show more light than its opacity; none: opaque
/// \throws OutputError
void writePng(const std::string& path, const Image& image, double exposure = 0,
              const std::vector<float>* alpha = nullptr);

}  // namespace vdb_diffuse
