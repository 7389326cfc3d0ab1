#include "scene/dome_samples.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vdb_diffuse {
namespace {

constexpr double kPi = 3.14159265358979323846;

DomeLight domeOf(Image image, double rotation = 0) {
  return {Vec3d(1), std::make_shared<Image>(std::move(image)), rotation};
}

Image blackImage(int width, int height) {
  return {width, height, std::vector<Vec3f>(size_t(width) * height, Vec3f(0))};
}

/// Something with colour and structure everywhere.
Image mottledImage(int width, int height) {
  Image image = blackImage(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double u = 2 * kPi * x / width, v = kPi * y / height;
      image.pixels[size_t(y) * width + x] =
          Vec3f(1 + std::sin(3 * u) * std::sin(v), 1.5 + std::cos(2 * u + 5 * v), 0.2 + 0.1 * (x % 3));
    }
  return image;
}

double pixelSolidAngle(const Image& image, int y) {
  return 2 * kPi / image.width * (std::cos(kPi * y / image.height) - std::cos(kPi * (y + 1) / image.height));
}

Vec3d total(const std::vector<BeamSample>& beams) {
  Vec3d sum(0);
  for (const BeamSample& b : beams) sum += b.irradiance;
  return sum;
}

Vec3d onPlane(const std::vector<BeamSample>& beams, const Vec3d& normal) {
  Vec3d sum(0);
  for (const BeamSample& b : beams) sum += b.irradiance * std::max(0.0, -b.direction.dot(normal));
  return sum;
}

const Vec3d kNormals[] = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0, -1, 0}, {0.6, 0, 0.8}, {-0.48, 0.6, -0.64}};

TEST(DomeSamples, UniformDomeCarriesFourPiL) {
  const auto beams = sampleDome({Vec3d(1, 2, 3), nullptr, 0}, 64);
  ASSERT_EQ(beams.size(), 64u);
  EXPECT_LT((total(beams) - 4 * kPi * Vec3d(1, 2, 3)).length(), 1e-11);
  for (const Vec3d& n : kNormals) EXPECT_NEAR(onPlane(beams, n)[0], kPi, kPi / 64);
}

TEST(DomeSamples, ImageCarriesTheIntegralOfEveryChannel) {
  for (const Image& image :
       {mottledImage(37, 18), mottledImage(2, 1), mottledImage(1, 1), mottledImage(3, 50)})
    for (int count : {1, 5, 64, 1000}) {
      Vec3d integral(0);
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
          integral += Vec3d(image.pixels[size_t(y) * image.width + x]) * pixelSolidAngle(image, y);
      const auto beams = sampleDome(domeOf(image), count);
      EXPECT_LE(beams.size(), size_t(count));
      EXPECT_LT((total(beams) - integral).length(), 1e-10);
    }
}

TEST(DomeSamples, ImageOfOneColourLightsPlanesLikeAUniformDome) {
  Image image = blackImage(64, 32);
  for (Vec3f& p : image.pixels) p = Vec3f(1);
  const auto beams = sampleDome(domeOf(image), 64);
  ASSERT_EQ(beams.size(), 64u);
  for (const Vec3d& n : kNormals) EXPECT_NEAR(onPlane(beams, n)[0], kPi, 0.03 * kPi);
}

TEST(DomeSamples, PlaneIrradianceConvergesToTheImages) {
  const DomeLight dome = domeOf(mottledImage(48, 24), 0.7);
  const auto directions = sphereDirections(200000);
  double error[2] = {0, 0};
  for (const Vec3d& n : kNormals) {
    Vec3d exact(0);
    for (const Vec3d& d : directions)
      exact += domeRadiance(dome, d) * (std::max(0.0, -d.dot(n)) * 4 * kPi / directions.size());
    for (int i : {0, 1})
      error[i] =
          std::max(error[i], (onPlane(sampleDome(dome, i ? 256 : 16), n) - exact).length() / exact.length());
  }
  EXPECT_LT(error[0], 0.2);
  EXPECT_LT(error[1], 0.02);
}

// u = 1/2 - atan2(y, x)/2pi: the middle column looks along +x, a quarter along +y; the first row along +z.
TEST(DomeSamples, OneHotPixelShinesFromWhereCyclesHasIt) {
  const struct {
    int x, y;
    Vec3d from;
  } cases[] = {{50, 24, {1, 0, 0}},  {25, 24, {0, 1, 0}}, {75, 24, {0, -1, 0}}, {0, 24, {-1, 0, 0}},
               {99, 24, {-1, 0, 0}}, {7, 0, {0, 0, 1}},   {60, 48, {0, 0, -1}}};
  const double pixel = 1.01 * kPi / 49;
  for (const auto& c : cases) {
    Image image = blackImage(100, 49);
    image.pixels[size_t(c.y) * 100 + c.x] = Vec3f(7, 5, 3);
    const DomeLight dome = domeOf(image);
    for (const BeamSample& beam : sampleDome(dome, 64)) {
      EXPECT_LT((beam.direction + c.from).length(), pixel);
      EXPECT_NEAR(beam.direction.length(), 1, 1e-12);
      EXPECT_EQ(domeRadiance(dome, beam.direction), Vec3d(7, 5, 3));
    }
    EXPECT_NEAR(total(sampleDome(dome, 64))[0], 7 * pixelSolidAngle(image, c.y), 1e-12);
    EXPECT_EQ(domeRadiance(dome, c.from), Vec3d(0)) << "light that travels towards where it should come from";
  }
}

TEST(DomeSamples, RotationTurnsCounterClockwiseSeenFromAbove) {
  Image image = blackImage(100, 49);
  image.pixels[24 * 100 + 50] = Vec3f(1);
  const DomeLight dome = domeOf(image, kPi / 2);  // from +x to +y
  EXPECT_EQ(domeRadiance(dome, Vec3d(-0.02, -1, 0).unit()), Vec3d(1));
  for (const BeamSample& beam : sampleDome(dome, 64))
    EXPECT_LT((beam.direction + Vec3d(0, 1, 0)).length(), 0.07);
}

TEST(DomeSamples, SunInTheImageLeavesBeamsForTheSky) {
  Image image = blackImage(256, 128);
  for (Vec3f& p : image.pixels) p = Vec3f(1);
  image.pixels[40 * 256 + 100] = Vec3f(1e5);
  const double sun = 1e5 * pixelSolidAngle(image, 40);
  const double theta = kPi * 40.5 / 128, phi = kPi - 2 * kPi * 100.5 / 256;
  const Vec3d from(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
  double near_sun = 0;
  int sky = 0;
  const auto beams = sampleDome(domeOf(image), 64);
  for (const BeamSample& b : beams) {
    if (b.direction.dot(-from) > std::cos(0.02))
      near_sun += b.irradiance[0];
    else
      ++sky;
  }
  EXPECT_NEAR(near_sun, sun, 0.02 * sun);
  EXPECT_GT(sky, 32);
}

}  // namespace
}  // namespace vdb_diffuse
