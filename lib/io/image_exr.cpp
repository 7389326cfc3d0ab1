#include <ImathBox.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>
#include <ImfStringAttribute.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>

#include "grid/error.h"
#include "io/image.h"
#include "io/whole_file.h"

namespace vdb_diffuse {
namespace {

uint64_t fileSize(const std::string& path) {
  struct stat info;
  if (::stat(path.c_str(), &info) != 0) throw InputError(path + ": " + std::strerror(errno));
  if (!S_ISREG(info.st_mode)) throw InputError(path + ": not a regular file; give an EXR image");
  return static_cast<uint64_t>(info.st_size);
}

/// The parts of an EXR's header that say how much memory a reader will take, read by ourselves: the library
/// allocates by them before it looks whether the file can hold what they promise.
struct Outline {
  int32_t data[4] = {0, 0, -1, -1}, display[4] = {0, 0, -1, -1};  // x0 y0 x1 y1, inclusive
  uint32_t tile[2] = {0, 0};
  bool has_data = false, has_display = false, has_tile = false;
};

class Bytes {
 public:
  Bytes(const std::string& path, uint64_t size) : path_(path), left_(size), stream_(path, std::ios::binary) {}
  void read(void* to, uint64_t count) {
    take(count);
    stream_.read(static_cast<char*>(to), static_cast<std::streamsize>(count));
    if (!stream_) damaged();
  }
  template <typename T>
  T value() {  // the format is little-endian, as are all machines that OpenVDB's own files are read on
    T v;
    read(&v, sizeof v);
    return v;
  }
  std::string name() {
    std::string text;
    for (char c; (c = value<char>()) != 0;) {
      text += c;
      if (text.size() > 255) damaged();  // the format's own limit
    }
    return text;
  }
  void skip(uint64_t count) {
    take(count);
    stream_.seekg(static_cast<std::streamoff>(count), std::ios::cur);
  }
  [[noreturn]] void damaged() const {
    throw InputError(path_ + ": damaged EXR header; write the image again");
  }

 private:
  void take(uint64_t count) {
    if (count > left_) damaged();
    left_ -= count;
  }
  const std::string& path_;
  uint64_t left_;
  std::ifstream stream_;
};

Outline readOutline(const std::string& path, uint64_t size) {
  constexpr uint32_t kMagic = 20000630, kTiled = 0x200, kDeep = 0x800, kMultiPart = 0x1000;
  if (size < 8) throw InputError(path + ": not an EXR image");
  Bytes bytes(path, size);
  if (bytes.value<uint32_t>() != kMagic) throw InputError(path + ": not an EXR image");
  const uint32_t version = bytes.value<uint32_t>();
  if ((version & 0xff) != 2) throw InputError(path + ": an EXR of an unknown version");
  if (version & kDeep) throw InputError(path + ": a deep EXR; give a flat image");
  if (version & kMultiPart) throw InputError(path + ": a multi-part EXR; give an image with one part");
  Outline outline;
  for (std::string name = bytes.name(); !name.empty(); name = bytes.name()) {
    bytes.name();  // the type, which the library checks
    const int32_t length = bytes.value<int32_t>();
    if (length < 0) bytes.damaged();
    if (name == "dataWindow" && length == sizeof outline.data) {
      bytes.read(outline.data, sizeof outline.data);
      outline.has_data = true;
    } else if (name == "displayWindow" && length == sizeof outline.display) {
      bytes.read(outline.display, sizeof outline.display);
      outline.has_display = true;
    } else if (name == "tiles" && length == 9) {
      bytes.read(outline.tile, sizeof outline.tile);
      bytes.skip(1);
      outline.has_tile = true;
    } else {
      bytes.skip(static_cast<uint64_t>(length));
    }
  }
  if (!outline.has_data || !outline.has_display || ((version & kTiled) && !outline.has_tile)) bytes.damaged();
  return outline;
}

void checkOutline(const std::string& path, const Outline& outline, uint64_t size) {
  const int64_t width = int64_t{outline.data[2]} - outline.data[0] + 1;
  const int64_t height = int64_t{outline.data[3]} - outline.data[1] + 1;
  const std::string extent = std::to_string(width) + " x " + std::to_string(height);
  if (width < 1 || height < 1) throw InputError(path + ": an empty picture (" + extent + ")");
  if (width > kMaxImagePixels || height > kMaxImagePixels || width * height > kMaxImagePixels)
    throw InputError(path + ": " + extent + " pixels are more than the " + std::to_string(kMaxImagePixels) +
                     " allowed; scale the image down");
  if (!std::equal(outline.data, outline.data + 4, outline.display))
    throw InputError(path + ": the data window differs from the display window; give an uncropped image");

  // A chunk is at most 256 lines (DWAB), or a tile, and takes 8 bytes in the offset table and 8 before its
  // data.
  int64_t chunks = (height + 255) / 256;
  if (outline.has_tile) {
    const int64_t w = outline.tile[0], h = outline.tile[1];
    if (w < 1 || h < 1) throw InputError(path + ": damaged EXR header: empty tiles");
    chunks = ((width + w - 1) / w) * ((height + h - 1) / h);
  }
  // Beyond 200 MB of memory the file must show some content; up to there one flat colour may pack as it
  // likes.
  constexpr int64_t kSmallPixels = 1 << 24, kPixelsPerByte = 1024;
  const int64_t least =
      std::max(chunks * 16, width * height > kSmallPixels ? width * height / kPixelsPerByte : 0);
  if (static_cast<int64_t>(size) < least)
    throw InputError(path + ": " + std::to_string(size) + " bytes are too few for " + extent +
                     " pixels; the file is truncated or damaged");
}

Image readPixels(const std::string& path) {
  Imf::InputFile file(path.c_str());
  const Imf::Header& header = file.header();
  const Imf::ChannelList& channels = header.channels();
  std::vector<const char*> names{"R", "G", "B"};
  if (!channels.findChannel("R") && !channels.findChannel("G") && !channels.findChannel("B")) {
    if (channels.findChannel("RY") || channels.findChannel("BY"))
      throw InputError(path + ": luminance and chroma channels; give an image with R, G, B");
    names = {"Y"};
  }
  for (const char* name : names) {
    const Imf::Channel* channel = channels.findChannel(name);
    if (!channel) {
      std::string present;
      for (auto c = channels.begin(); c != channels.end(); ++c) present += std::string(" ") + c.name();
      throw InputError(path + ": no channels R, G, B or Y; there are:" + present);
    }
    if (channel->type == Imf::UINT || channel->xSampling != 1 || channel->ySampling != 1)
      throw InputError(path + ": channel " + name +
                       " is an integer or subsampled; give half or float pixels");
  }
  if (!file.isComplete()) throw InputError(path + ": the image is incomplete");

  const Imath::Box2i window = header.dataWindow();
  Image image;
  image.width = window.max.x - window.min.x + 1;
  image.height = window.max.y - window.min.y + 1;
  image.pixels.resize(static_cast<size_t>(image.width) * image.height);
  Imf::FrameBuffer buffer;
  for (size_t c = 0; c < names.size(); ++c)
    buffer.insert(names[c], Imf::Slice::Make(Imf::FLOAT, &image.pixels[0][static_cast<int>(c)], window,
                                             sizeof(Vec3f), sizeof(Vec3f) * image.width));
  file.setFrameBuffer(buffer);
  file.readPixels(window.min.y, window.max.y);
  if (names.size() == 1)
    for (Vec3f& p : image.pixels) p = Vec3f(p[0]);
  return image;
}

void checkPixels(const std::string& path, const Image& image) {
  size_t bad = 0, first = 0;
  for (size_t i = 0; i < image.pixels.size(); ++i) {
    const Vec3f& p = image.pixels[i];
    const bool good = std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]) && p[0] >= 0 &&
                      p[1] >= 0 && p[2] >= 0;
    if (!good && bad++ == 0) first = i;
  }
  if (bad == 0) return;
  throw InputError(path + ": " + std::to_string(bad) +
                   " pixels are NaN, infinite or negative, the first at (" +
                   std::to_string(first % image.width) + ", " + std::to_string(first / image.width) +
                   ") from the upper left; repair the image");
}

}  // namespace

Image readExr(const std::string& path) {
  const uint64_t size = fileSize(path);
  checkOutline(path, readOutline(path, size), size);
  Image image;
  try {
    image = readPixels(path);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    std::string what = error.what();
    std::replace(what.begin(), what.end(), '\n', ' ');
    throw InputError(path + ": the EXR cannot be read: " + what);
  }
  checkPixels(path, image);
  return image;
}

void writeExr(const std::string& path, const Image& image, const ExrOptions& options) {
  const size_t pixels = image.pixels.size();
  std::vector<std::string> names{"R", "G", "B"};
  if (options.alpha) names.push_back("A");
  const size_t own = names.size();
  for (const auto& [layer, picture] : options.layers)
    for (const char* colour : {".R", ".G", ".B"}) names.push_back(layer + colour);
  const size_t channels = names.size();
  std::vector<float> floats(pixels * channels);
  for (size_t i = 0; i < pixels; ++i) {
    float* to = &floats[i * channels];
    for (size_t c = 0; c < own; ++c)
      to[c] = c < 3 ? image.pixels[i][static_cast<int>(c)] : (*options.alpha)[i];
    for (size_t l = 0; l < options.layers.size(); ++l)
      for (int c = 0; c < 3; ++c) to[own + 3 * l + c] = options.layers[l].second->pixels[i][c];
  }
  std::vector<Imath::half> halves;
  if (options.half) {
    const float largest = HALF_MAX;
    halves.resize(floats.size());
    std::transform(floats.begin(), floats.end(), halves.begin(),
                   [=](float v) { return Imath::half(std::clamp(v, -largest, largest)); });
  }

  std::string bytes;
  try {
    Imf::Header header(image.width, image.height);
    const Imf::PixelType type = options.half ? Imf::HALF : Imf::FLOAT;
    char* base =
        options.half ? reinterpret_cast<char*>(halves.data()) : reinterpret_cast<char*>(floats.data());
    const size_t step = options.half ? sizeof(Imath::half) : sizeof(float);
    Imf::FrameBuffer buffer;
    for (size_t c = 0; c < channels; ++c) {
      header.channels().insert(names[c].c_str(), Imf::Channel(type));
      buffer.insert(names[c].c_str(),
                    Imf::Slice(type, base + c * step, channels * step, channels * step * image.width));
    }
    for (const auto& [name, text] : options.attributes) header.insert(name, Imf::StringAttribute(text));
    // Encoded in memory, so that a full disk is met by one checked write.
    Imf::StdOSStream stream;
    {
      Imf::OutputFile file(stream, header);
      file.setFrameBuffer(buffer);
      file.writePixels(image.height);
    }
    bytes = stream.str();
  } catch (const std::exception& error) {
    throw OutputError(path + ": the EXR could not be encoded: " + error.what());
  }
  writeWholeFile(path, bytes);
}

}  // namespace vdb_diffuse
