// A libFuzzer target for EXR images (see fuzz.sh).
#include <cmath>

#include "hard/fuzzed_file.h"
#include "io/image.h"

namespace vdb_diffuse {
namespace {

void readFile(const std::string& path) {
  const Image image = readExr(path);
  expect(image.width > 0 && image.height > 0, "a picture has a size");
  expect(image.pixels.size() == size_t(image.width) * image.height, "there is a pixel for each place");
  for (const Vec3f& p : image.pixels)
    for (int c = 0; c < 3; ++c) expect(std::isfinite(p[c]) && p[c] >= 0, "pixels are finite and >= 0");
}

}  // namespace
}  // namespace vdb_diffuse

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const vdb_diffuse::TemporaryFolder folder;
  return vdb_diffuse::readFuzzed(folder, "in.exr", data, size, vdb_diffuse::readFile);
}
