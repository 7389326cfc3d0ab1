#include "io/image.h"

#include <gtest/gtest.h>
#include <png.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

namespace fs = std::filesystem;

class ImageFile : public testing::Test {
 protected:
  ImageFile() {
    std::string name = (fs::temp_directory_path() / "image_test.XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~ImageFile() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  size_t fileCount() const {
    return static_cast<size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  static std::string bytesOf(const std::string& path) {
    std::ifstream stream(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  }
  static void store(const std::string& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
  }
  /// The message with which a file is refused.
  static std::string refusal(const std::string& path) {
    try {
      readExr(path);
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      EXPECT_NE(std::string(error.what()).find(path), std::string::npos);
      return error.what();
    }
    ADD_FAILURE() << path << " was accepted";
    return "";
  }
  fs::path folder_;
};

Image ramp(int width, int height) {
  Image image{width, height, {}};
  for (int i = 0; i < width * height; ++i)
    image.pixels.emplace_back(0.001f * i, std::exp(0.01f * i), i % 7 == 0 ? 0.0f : 1e6f / (i + 1));
  return image;
}

TEST_F(ImageFile, ExrKeepsFloatsToTheBit) {
  const Image image = ramp(37, 19);
  writeExr(path("a.exr"), image);
  const Image back = readExr(path("a.exr"));
  EXPECT_EQ(back.width, 37);
  EXPECT_EQ(back.height, 19);
  EXPECT_EQ(back.pixels, image.pixels);
  EXPECT_EQ(fileCount(), 1u);
}

TEST_F(ImageFile, ExrHalfIsCloseAndNeverInfinite) {
  const Image image = ramp(37, 19);
  writeExr(path("a.exr"), image, {true, nullptr, {}});
  const Image back = readExr(path("a.exr"));
  for (size_t i = 0; i < image.pixels.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const float v = std::min(image.pixels[i][c], 65504.0f);
      EXPECT_NEAR(back.pixels[i][c], v, v / 2048 + 1e-7);
    }
  EXPECT_LT(fs::file_size(path("a.exr")), 37u * 19 * 3 * 4);
}

TEST_F(ImageFile, ExrCarriesAlphaAndAttributes) {
  const std::vector<float> alpha(37 * 19, 0.25f);
  writeExr(path("a.exr"), ramp(37, 19), {false, &alpha, {{"density", "smoke"}}});
  const std::string bytes = bytesOf(path("a.exr"));
  const std::string no_sampling("\1\0\0\0\1\0\0\0", 8),
      channel = std::string("\2\0\0\0\0\0\0\0", 8) + no_sampling;
  EXPECT_NE(bytes.find(std::string("A\0", 2) + channel + std::string("B\0", 2) + channel), std::string::npos);
  EXPECT_NE(bytes.find(std::string("density\0string\0\5\0\0\0smoke", 24)), std::string::npos);
  EXPECT_EQ(readExr(path("a.exr")).pixels, ramp(37, 19).pixels);
}

/// A file as another program might write it: uncompressed lines, the same `data` in each channel. Names in
/// alphabetical order.
std::string exrOf(const std::vector<std::string>& names, const std::vector<float>& data, int32_t width,
                  int32_t height, int32_t type = 2 /* float */) {
  const auto raw = [](auto v) { return std::string(reinterpret_cast<const char*>(&v), sizeof v); };
  std::string bytes = raw(int32_t{20000630}) + raw(int32_t{2});
  const auto attribute = [&](const std::string& name, const std::string& kind, const std::string& value) {
    bytes += name + '\0' + kind + '\0' + raw(static_cast<int32_t>(value.size())) + value;
  };
  std::string channels;
  for (const std::string& name : names)
    channels += name + '\0' + raw(type) + raw(int32_t{0}) + raw(int32_t{1}) + raw(int32_t{1});
  const std::string window = raw(int32_t{0}) + raw(int32_t{0}) + raw(width - 1) + raw(height - 1);
  attribute("channels", "chlist", channels + '\0');
  attribute("compression", "compression", std::string(1, '\0'));
  attribute("dataWindow", "box2i", window);
  attribute("displayWindow", "box2i", window);
  attribute("lineOrder", "lineOrder", std::string(1, '\0'));
  attribute("pixelAspectRatio", "float", raw(1.0f));
  attribute("screenWindowCenter", "v2f", raw(0.0f) + raw(0.0f));
  attribute("screenWindowWidth", "float", raw(1.0f));
  bytes += '\0';
  const int32_t line = 4 * width * static_cast<int32_t>(names.size());
  const size_t first = bytes.size() + 8 * height;
  for (int32_t y = 0; y < height; ++y) bytes += raw(static_cast<uint64_t>(first + y * (8 + line)));
  for (int32_t y = 0; y < height; ++y) {
    bytes += raw(y) + raw(line);
    for (size_t c = 0; c < names.size(); ++c)
      for (int32_t x = 0; x < width; ++x) bytes += raw(data[y * width + x]);
  }
  return bytes;
}

TEST_F(ImageFile, LuminanceBecomesGrey) {
  store(path("y.exr"), exrOf({"Y"}, {1, 2, 3, 4, 5, 6}, 3, 2));
  EXPECT_EQ(readExr(path("y.exr")).pixels[4], Vec3f(5, 5, 5));
}

TEST_F(ImageFile, ChannelsThatAreNoColourAreNamed) {
  store(path("z.exr"), exrOf({"Z", "depth.V"}, {1, 2, 3, 4, 5, 6}, 3, 2));
  EXPECT_NE(refusal(path("z.exr")).find("Z depth.V"), std::string::npos);
  store(path("u.exr"), exrOf({"B", "G", "R"}, {1, 2, 3, 4, 5, 6}, 3, 2, 0 /* integer */));
  refusal(path("u.exr"));
}

TEST_F(ImageFile, PixelsThatAreNoRadianceAreCountedAndTheFirstNamed) {
  const float nan = std::nanf(""), infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {nan, infinity, -1e-6f}) {
    Image image = ramp(10, 5);
    image.pixels[23][1] = bad;
    image.pixels[31][2] = bad;
    writeExr(path("bad.exr"), image);
    const std::string message = refusal(path("bad.exr"));
    EXPECT_NE(message.find("2 pixels"), std::string::npos);
    EXPECT_NE(message.find("(3, 2)"), std::string::npos);
  }
}

TEST_F(ImageFile, WhatIsNotAFileOrNotAnExrIsRefusedAtOnce) {
  refusal(path("missing.exr"));
  refusal(folder_.string());
  ASSERT_EQ(mkfifo(path("pipe.exr").c_str(), 0600), 0);
  refusal(path("pipe.exr"));
  store(path("empty.exr"), "");
  refusal(path("empty.exr"));
  store(path("text.exr"), "this is not a picture at all, whatever its name says");
  refusal(path("text.exr"));
}

TEST_F(ImageFile, EveryTruncationIsRefused) {
  writeExr(path("a.exr"), ramp(20, 40));
  const std::string whole = bytesOf(path("a.exr"));
  for (size_t size = 0; size < whole.size(); size += 1 + whole.size() / 200) {
    store(path("cut.exr"), whole.substr(0, size));
    refusal(path("cut.exr"));
  }
}

TEST_F(ImageFile, DamagedBytesGiveACleanErrorOrAFinitePicture) {
  writeExr(path("a.exr"), ramp(20, 40));
  const std::string whole = bytesOf(path("a.exr"));
  uint64_t state = 1;
  for (int round = 0; round < 1000; ++round) {
    std::string bytes = whole;
    for (int k = 0; k < 3; ++k) {
      state = state * 6364136223846793005ull + 1442695040888963407ull;
      const size_t limit = round % 2 ? bytes.size() : 400;  // the header more often
      bytes[(state >> 33) % limit] = static_cast<char>(state >> 20);
    }
    store(path("cut.exr"), bytes);
    try {
      for (const Vec3f& p : readExr(path("cut.exr")).pixels) ASSERT_TRUE(std::isfinite(p[0]) && p[0] >= 0);
    } catch (const InputError&) {
    }
  }
}

/// Sets the data and display windows of a stored picture.
std::string withWindows(std::string bytes, const std::array<int32_t, 4>& data,
                        const std::array<int32_t, 4>& display) {
  for (const auto& [name, window] :
       {std::make_pair("dataWindow", data), std::make_pair("displayWindow", display)}) {
    const size_t at = bytes.find(std::string(name) + '\0' + "box2i") + std::strlen(name) + 1 + 6 + 4;
    std::memcpy(&bytes[at], window.data(), 16);
  }
  return bytes;
}

TEST_F(ImageFile, WindowsThatTheFileCannotFillAreRefusedBeforeMemoryIsTaken) {
  writeExr(path("a.exr"), ramp(20, 40));
  const std::string bytes = bytesOf(path("a.exr"));
  const int32_t most = std::numeric_limits<int32_t>::max();
  for (const std::array<int32_t, 4>& window : {std::array<int32_t, 4>{0, 0, most, most},
                                               {-most, -most, most, most},
                                               {0, 0, 1 << 20, 1 << 20},
                                               {0, 0, 12000, 10000},
                                               {0, 0, 0, 1 << 24},
                                               {5, 5, 4, 4}}) {
    store(path("big.exr"), withWindows(bytes, window, window));
    refusal(path("big.exr"));
  }
  store(path("big.exr"), withWindows(bytes, {0, 0, 19999, 9999}, {0, 0, 19999, 9999}));
  fs::resize_file(path("big.exr"), 4000000000);  // sparse: long enough, but more than is ever taken in
  EXPECT_NE(refusal(path("big.exr")).find("allowed"), std::string::npos);
  store(path("crop.exr"), withWindows(bytes, {0, 0, 19, 39}, {0, 0, 39, 79}));
  EXPECT_NE(refusal(path("crop.exr")).find("display window"), std::string::npos);
}

TEST_F(ImageFile, DeepAndMultiPartAreRefused) {
  writeExr(path("a.exr"), ramp(20, 40));
  std::string bytes = bytesOf(path("a.exr"));
  bytes[5] = 0x08;
  store(path("deep.exr"), bytes);
  EXPECT_NE(refusal(path("deep.exr")).find("deep"), std::string::npos);
  bytes[5] = 0x10;
  store(path("parts.exr"), bytes);
  EXPECT_NE(refusal(path("parts.exr")).find("multi-part"), std::string::npos);
}

std::vector<uint8_t> readPng(const std::string& path, uint32_t format) {
  png_image png = {};
  png.version = PNG_IMAGE_VERSION;
  EXPECT_TRUE(png_image_begin_read_from_file(&png, path.c_str()));
  png.format = format;
  std::vector<uint8_t> bytes(PNG_IMAGE_SIZE(png));
  EXPECT_TRUE(png_image_finish_read(&png, nullptr, bytes.data(), 0, nullptr));
  return bytes;
}

TEST_F(ImageFile, PngFollowsTheSrgbCurve) {
  // 0.2158605 linear is 128 of 255; 0.0030 lies on the straight part; above 1 is white.
  writePng(path("a.png"), {2, 1, {Vec3f(0.2158605f, 0.003f, 0), Vec3f(1, 7, 0.5f)}});
  const std::vector<uint8_t> expected{128, 10, 0, 255, 255, 188};
  EXPECT_EQ(readPng(path("a.png"), PNG_FORMAT_RGB), expected);
}

TEST_F(ImageFile, PngExposureIsInStops) {
  const Image image = ramp(16, 8);
  Image brighter = image;
  for (Vec3f& p : brighter.pixels) p *= 8;
  writePng(path("a.png"), image, 3);
  writePng(path("b.png"), brighter, 0);
  EXPECT_EQ(readPng(path("a.png"), PNG_FORMAT_RGB), readPng(path("b.png"), PNG_FORMAT_RGB));
}

TEST_F(ImageFile, PngAlphaIsStraight) {
  const std::vector<float> alpha{0.5f, 0};
  writePng(path("a.png"), {2, 1, {Vec3f(0.5f, 0.2158605f / 2, 0), Vec3f(0)}}, 0, &alpha);
  const std::vector<uint8_t> expected{255, 128, 0, 128, 0, 0, 0, 0};
  EXPECT_EQ(readPng(path("a.png"), PNG_FORMAT_RGBA), expected);
}

TEST_F(ImageFile, AFailedWriteLeavesTheOldFileAndNoOther) {
  for (const std::string name : {"a.exr", "a.png"}) {
    const auto write = [&](const Image& image) {
      name == "a.exr" ? writeExr(path(name), image) : writePng(path(name), image);
    };
    write(ramp(8, 8));
    const std::string old = bytesOf(path(name));
    const size_t files = fileCount();
    Image noise = ramp(200, 200);  // packs badly
    for (size_t i = 0; i < noise.pixels.size(); ++i) noise.pixels[i] = Vec3f(std::fmod(i * 0.618034f, 1.0f));
    rlimit before;
    getrlimit(RLIMIT_FSIZE, &before);
    rlimit small = before;
    small.rlim_cur = 4096;
    std::signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &small);
    EXPECT_THROW(write(noise), OutputError);
    setrlimit(RLIMIT_FSIZE, &before);
    EXPECT_EQ(bytesOf(path(name)), old);
    EXPECT_EQ(fileCount(), files);
  }
  EXPECT_THROW(writePng(path("no/such/folder/a.png"), ramp(2, 2)), OutputError);
}

}  // namespace
}  // namespace vdb_diffuse
