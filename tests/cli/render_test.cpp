#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "cli/png_pixels.h"
#include "cli/run_program.h"
#include "io/image.h"
#include "io/vdb_writer.h"

namespace vdb_diffuse {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kWidth = 2;  // of the cube, world units: 8 voxels of 0.25

/// The cube, all of density 1.
Volume cube(const Vec3d& origin = Vec3d(0)) {
  BlockMask on;
  on.setOn();
  Volume volume;
  volume.topology = std::make_shared<Topology>(std::vector<Coord>{{0, 0, 0}}, std::vector<BlockMask>{on});
  volume.transform = Transform::uniform(kWidth / kBlockWidth, origin);
  return volume;
}

/// A grid of one value, or of one vector, all over the cube.
OutputGrid constant(const std::string& name, const std::vector<double>& value,
                    const Metadata& metadata = {}) {
  OutputGrid grid;
  grid.name = name;
  grid.metadata = metadata;
  for (const double v : value) grid.channels.emplace_back(*cube().topology, static_cast<float>(v));
  return grid;
}

/// What a ray across the cube sees of light that each length of it sends: int_0^kWidth e exp(-sigma_t t) dt.
double across(double emitted, double sigma_t) {
  return emitted * -std::expm1(-sigma_t * kWidth) / sigma_t;
}

class RenderCommand : public testing::Test {
 protected:
  template <typename... Grids>
  void write(const Grids&... grids) {
    writeVdb(lit_, cube(), {grids...});
  }
  Outcome run(const std::string& flags) const { return runProgram("render '" + lit_ + "' " + flags); }

  /// Radiance of the middle of the cube, seen by an orthographic camera in this direction from there.
  Vec3f seen(const std::string& flags = "", const Vec3d& from = Vec3d(10, 0, 0)) const {
    const Vec3d middle(0.5 * (kWidth - kWidth / kBlockWidth)), p = middle + from;
    std::ostringstream view;
    view << " --size 3x3 --ortho 0.1 --constant-voxels --look-at " << middle[0] << ',' << middle[1] << ','
         << middle[2] << " --from " << p[0] << ',' << p[1] << ',' << p[2] << " -o " << exr_ << ' ';
    const Outcome outcome = run(view.str() + flags);
    EXPECT_EQ(outcome.status, 0) << outcome.error;
    if (outcome.status != 0) return Vec3f(-1);
    EXPECT_EQ(outcome.error, "");
    return readExr(exr_).pixels[4];
  }

  /// Of a channel of the picture, in the middle of three by three pixels.
  float valueIn(const std::string& channel) const {
    Imf::InputFile file(exr_.c_str());
    float values[9] = {};
    Imf::FrameBuffer buffer;
    buffer.insert(channel,
                  Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values), sizeof(float), 3 * sizeof(float)));
    file.setFrameBuffer(buffer);
    file.readPixels(0, 2);
    return values[4];
  }

  TemporaryFolder folder_;
  std::string lit_ = folder_.file("lit.vdb"), exr_ = folder_.file("lit.exr"), png_ = folder_.file("lit.png");
};

const OutputGrid kDensity = constant("density", {1});
constexpr double kPixel = 1e-4;  // relative: a ray may end where less than that comes through

TEST_F(RenderCommand, ShowsTheMediumThatTheLightWasBakedFor) {
  const Metadata stored = {{"sigma_s_r", 0.5}, {"sigma_s_g", 1.0}, {"sigma_s_b", 2.0},
                           {"sigma_a_r", 0.1}, {"sigma_a_g", 0.2}, {"sigma_a_b", 0.4}};
  write(kDensity, constant("diffuse", {3}, stored), constant("direct", {2}));
  const Vec3f both = seen();
  EXPECT_NEAR(both[0], across(0.5 * 5, 0.6), kPixel * both[0]);
  EXPECT_NEAR(both[1], across(1.0 * 5, 1.2), kPixel * both[1]);
  EXPECT_NEAR(both[2], across(2.0 * 5, 2.4), kPixel * both[2]);
  EXPECT_NEAR(seen("--light diffuse")[1], across(1.0 * 3, 1.2), kPixel * both[1]);
  EXPECT_NEAR(seen("--sigma-s 1.5")[0], across(1.5 * 5, 1.6), kPixel * 10) << "flags override";
  EXPECT_NEAR(seen("--sigma-t 2 --albedo 0.25")[2], across(0.5 * 5, 2), kPixel * 10);
}

TEST_F(RenderCommand, DensityHasTheNameThatWasStored) {
  const Metadata stored = {{"density", std::string("smoke")}};
  write(constant("smoke", {0.5}), kDensity, constant("diffuse", {1}, stored), constant("direct", {0}));
  EXPECT_NEAR(seen()[0], across(0.5, 0.5), kPixel);
  EXPECT_NEAR(seen("--density density")[0], across(1, 1), kPixel);
}

TEST_F(RenderCommand, LightMayBeColouredAndTheMediumGrey) {
  write(kDensity, constant("diffuse", {1, 2, 4}), constant("direct", {0, 0, 1}));
  const Vec3f pixel = seen();
  EXPECT_NEAR(pixel[0], across(1, 1), kPixel);
  EXPECT_NEAR(pixel[1], across(2, 1), 2 * kPixel);
  EXPECT_NEAR(pixel[2], across(5, 1), 5 * kPixel);
}

TEST_F(RenderCommand, FluxBrightensTheSideItFlowsTo) {
  const double g = 0.5, I1 = 0.8;
  const OutputGrid flux = constant("flux", {4 * kPi / 3 * I1, 0, 0});
  write(kDensity, constant("diffuse", {1}, {{"g", g}}), constant("direct", {0}), flux);
  EXPECT_NEAR(seen("", Vec3d(10, 0, 0))[0], across(1 + g * I1, 1), kPixel);
  EXPECT_NEAR(seen("", Vec3d(-10, 0, 0))[0], across(1 - g * I1, 1), kPixel);
  EXPECT_NEAR(seen("", Vec3d(0, 10, 0))[0], across(1, 1), kPixel);
}

TEST_F(RenderCommand, OwnGlowIsThatOfTheStoredGridAndScale) {
  const Metadata stored = {{"sigma_s_r", 0.0},
                           {"sigma_s_g", 0.0},
                           {"sigma_s_b", 0.0},
                           {"sigma_a_r", 0.7},
                           {"sigma_a_g", 0.7},
                           {"sigma_a_b", 0.7},
                           {"emission", std::string("flame")},
                           {"emission_scale", 3.0}};
  write(kDensity, constant("diffuse", {1}, stored), constant("direct", {1}), constant("flame", {2}));
  EXPECT_NEAR(seen()[0], across(0.7 * 3 * 2, 0.7), 5 * kPixel);
  EXPECT_NEAR(seen("--emission-scale 1")[0], across(0.7 * 2, 0.7), 2 * kPixel);
}

TEST_F(RenderCommand, WhatIsMissingButNotNeededIsAWarning) {
  const Metadata stored = {{"g", 0.5}, {"emission", std::string("flame")}};
  write(kDensity, constant("diffuse", {1}, stored), constant("direct", {1}));
  const Outcome outcome = run("--size 8x8 -o " + png_);
  EXPECT_EQ(outcome.status, 0);
  EXPECT_NE(outcome.error.find("vdb_diffuse render: warning: " + lit_ + ": no grid flux"), std::string::npos);
  EXPECT_NE(outcome.error.find("bake with --keep flame"), std::string::npos) << outcome.error;
}

TEST_F(RenderCommand, PngIsTheRadianceOnAScreen) {
  write(kDensity, constant("diffuse", {0.5}), constant("direct", {0}));
  const Outcome outcome = run("--size 20x10 --exposure 0 --sigma-s 50 -o " + png_);
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  EXPECT_NE(outcome.out.find("lit.png: 20x10, exposure 0 stops\n"), std::string::npos) << outcome.out;

  const PngPixels png = pixelsOf(contentsOf(png_));
  EXPECT_EQ(png.width, 20);
  EXPECT_EQ(png.height, 10);
  EXPECT_EQ(png.at(0, 0)[0], 0) << "the background is black";
  EXPECT_NEAR(png.at(10, 5)[0], 188, 1) << "sRGB of 0.5, as the cube is opaque";
}

TEST_F(RenderCommand, LayersAddUpToThePicture) {
  write(kDensity, constant("diffuse", {3, 1, 0}), constant("direct", {2, 2, 2}));
  const Vec3f both = seen("--layers");
  EXPECT_NEAR(both[0], across(5, 1), kPixel * both[0]);
  const Imf::InputFile file(exr_.c_str());
  std::vector<std::string> names;
  for (auto c = file.header().channels().begin(); c != file.header().channels().end(); ++c)
    names.push_back(c.name());
  EXPECT_EQ(names, (std::vector<std::string>{"A", "B", "G", "R", "diffuse.B", "diffuse.G", "diffuse.R",
                                             "direct.B", "direct.G", "direct.R"}));
  EXPECT_NEAR(valueIn("direct.R"), across(2, 1), kPixel * both[0]);
  EXPECT_NEAR(valueIn("diffuse.R"), across(3, 1), kPixel * both[0]);
  EXPECT_NEAR(valueIn("diffuse.G"), across(1, 1), kPixel * both[0]);
  EXPECT_NEAR(valueIn("diffuse.B"), 0, kPixel * both[0]);
  EXPECT_NEAR(valueIn("A"), 1 - std::exp(-kWidth), kPixel);
}

TEST_F(RenderCommand, ASheetShowsDirectDiffuseAndBothSideBySide) {
  write(kDensity, constant("diffuse", {0.5}), constant("direct", {0.02}));
  const Outcome outcome = run("--size 20x10 --exposure 0 --sigma-s 50 --sheet -o " + png_);
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  const PngPixels png = pixelsOf(contentsOf(png_));
  EXPECT_EQ(png.width, 3 * 20 + 4 * 8);
  const int y = 34 + 5;
  EXPECT_NEAR(png.at(8 + 10, y)[0], 39, 1) << "sRGB of 0.02";
  EXPECT_NEAR(png.at(8 + 28 + 10, y)[0], 188, 1) << "sRGB of 0.5";
  EXPECT_NEAR(png.at(8 + 56 + 10, y)[0], 191, 1) << "sRGB of 0.52";
  EXPECT_EQ(png.at(8, 34)[0], 0) << "the background";
  EXPECT_EQ(png.at(2, y)[0], 255) << "the sheet";
}

TEST_F(RenderCommand, ATurntableIsAPicturePerStepUnderOneExposure) {
  write(kDensity, constant("diffuse", {1}), constant("direct", {1}));
  const Outcome outcome = run("--size 16x12 --turntable 3 -o '" + folder_.file("turn.##.png") + "'");
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  std::vector<std::string> exposures;
  for (size_t at = outcome.out.find("exposure "); at != std::string::npos;
       at = outcome.out.find("exposure ", at + 1))
    exposures.push_back(outcome.out.substr(at, outcome.out.find('\n', at) - at));
  ASSERT_EQ(exposures.size(), 3u) << outcome.out;
  EXPECT_EQ(exposures[0], exposures[2]);
  for (const std::string name : {"turn.01.png", "turn.02.png", "turn.03.png"})
    EXPECT_EQ(pixelsOf(contentsOf(folder_.file(name))).width, 16) << name;
  EXPECT_NE(contentsOf(folder_.file("turn.01.png")), contentsOf(folder_.file("turn.02.png")));
  EXPECT_EQ(folder_.fileCount(), 4u);
}

TEST_F(RenderCommand, ASliceIsAPictureOfAGridsNumbers) {
  write(kDensity, constant("diffuse", {0.5}), constant("direct", {1}));
  const Outcome outcome = run("--slice z:0.6 --grid diffuse --range 0,0.5 -o " + png_);
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  EXPECT_NE(outcome.out.find("a slice of diffuse"), std::string::npos) << outcome.out;
  const PngPixels png = pixelsOf(contentsOf(png_));
  EXPECT_EQ(png.at(24 + 50, 76 + 50), (std::array<int, 3>{255, 250, 204})) << "the bright end of the scale";
  expectRefusal(run("--slice z:9 -o " + png_), 3, {"grid diffuse: ", "z = 9", "from 0 to 1.75"});
  expectRefusal(run("--slice z --grid flux -o " + png_), 3, {"no grid flux", "--grid"});
}

TEST_F(RenderCommand, WaysToLookThatExcludeEachOtherAreWrongUse) {
  write(kDensity, constant("diffuse", {1}), constant("direct", {1}));
  const std::string slice = "-o " + png_ + " --slice ";
  expectRefusal(run(slice + "w"), 2, {"--slice w", "x, y or z"});
  expectRefusal(run(slice + "x:"), 2, {"--slice x:", "number"});
  expectRefusal(run(slice + "x --range 2,1"), 2, {"--range 2,1", "lower first"});
  expectRefusal(run("--slice x -o " + exr_), 2, {"-o", ".png"});
  expectRefusal(run("--grid flux -o " + png_), 2, {"--grid flux", "--slice"});
  expectRefusal(run("--range 0,1 -o " + png_), 2, {"--range 0,1", "--slice"});
  expectRefusal(run("--sheet -o " + exr_), 2, {"--sheet", ".png"});
  expectRefusal(run("--layers -o " + png_), 2, {"--layers", ".exr"});
  expectRefusal(run("--sheet --light direct -o " + png_), 2, {"--light direct", "--sheet"});
  expectRefusal(run("--turntable 3 -o " + png_), 2, {"-o", "####"});
  EXPECT_EQ(folder_.fileCount(), 1u) << "no picture was begun";
}

TEST_F(RenderCommand, QuietSaysNothingAndProgressIsJson) {
  write(kDensity, constant("diffuse", {1}), constant("direct", {1}));
  const Outcome quiet = run("--quiet --size 8x8 -o " + png_);
  EXPECT_EQ(quiet.out + quiet.error, "");
  const Outcome told = run("--progress json --size 8x8 -o " + png_);
  EXPECT_EQ(told.error.find("{\"phase\":\""), 0u) << told.error;
  EXPECT_NE(runProgram("render --help").out.find("Example:\n  vdb_diffuse bake"), std::string::npos);
}

TEST_F(RenderCommand, WrongUseIsTwoAndNamesFlagAndValue) {
  write(kDensity, constant("diffuse", {1}), constant("direct", {1}));
  expectRefusal(run("-o " + folder_.file("lit.jpg")), 2, {"vdb_diffuse render: ", "lit.jpg", ".exr", ".png"});
  expectRefusal(run("-o " + png_ + " --size 12by7"), 2, {"--size 12by7", "WxH"});
  expectRefusal(run("-o " + png_ + " --size 999999x999999"), 2, {"--size", "pixels"});
  expectRefusal(run("-o " + png_ + " --from 1,2"), 2, {"--from 1,2", "X,Y,Z"});
  expectRefusal(run("-o " + png_ + " --sigma-s -1"), 2, {"--sigma-s -1", "negative"});
  expectRefusal(run("-o " + png_ + " --sigma-t 1"), 2, {"--sigma-t 1", "--albedo"});
  expectRefusal(run("-o " + png_ + " --light none"), 2, {"--light", "none"});
  expectRefusal(run("-o " + png_ + " --up x"), 2, {"--up x", "y or z"});
  std::filesystem::create_symlink(lit_, exr_);
  expectRefusal(run("-o " + exr_), 2, {"-o", "is the input file"});
  EXPECT_EQ(folder_.fileCount(), 2u) << "no picture was begun";
}

TEST_F(RenderCommand, InputThatIsMissingIsThreeAndTellsWhatThereIs) {
  expectRefusal(run("-o " + png_), 3, {"vdb_diffuse render: ", "lit.vdb", "No such file"});
  write(kDensity, constant("direct", {1}), constant("flame", {1}));
  expectRefusal(run("-o " + png_), 3, {"no grid diffuse", "density, direct, flame", "bake", "--light"});
  expectRefusal(run("--light direct --density smoke -o " + png_), 3,
                {"no grid smoke", "density, direct, flame", "--density"});
  expectRefusal(run("--light direct --emission flam -o " + png_), 3, {"no grid flam", "did you mean flame?"});
  EXPECT_EQ(run("--light direct --size 8x8 -o " + png_).status, 0);
}

TEST_F(RenderCommand, LightThatIsNotFiniteIsRefusedOrCountsAsZero) {
  OutputGrid diffuse = constant("diffuse", {-1});  // of either sign, as a bake may leave it
  diffuse.channels[0].block(0)[77] = std::numeric_limits<float>::quiet_NaN();
  write(kDensity, diffuse, constant("direct", {3}));
  expectRefusal(run("-o " + png_), 3, {lit_ + ": grid diffuse: value", "outside", "--clamp"});
  EXPECT_NEAR(seen("--clamp")[0], across(2, 1), 2 * kPixel);
}

TEST_F(RenderCommand, LightOnOtherVoxelsIsInterpolated) {
  write(kDensity, constant("diffuse", {2}), constant("direct", {1}));
  const Vec3f own = seen();
  const std::string other = folder_.file("other.vdb");
  writeVdb(other, cube(Vec3d(0.1, 0, 0)), {constant("diffuse", {2})});
  const VdbFile source(other);
  writeVdb(lit_, cube(), {kDensity, constant("direct", {1})}, {}, &source, {"diffuse"});
  EXPECT_NEAR(seen()[0], own[0], kPixel * own[0]);
}

TEST_F(RenderCommand, FluxThatIsNoVectorIsRefused) {
  write(kDensity, constant("diffuse", {1}, {{"g", 0.5}}), constant("direct", {1}), constant("flux", {1}));
  expectRefusal(run("-o " + png_), 3, {"grid flux: holds no vectors"});
}

}  // namespace
}  // namespace vdb_diffuse
