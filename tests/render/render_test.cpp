#include "render/render.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <functional>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Voxels for which inside(p_index) holds, density rho(p_index), lighting fields of one channel.
LitVolume volumeOf(const Coord& low, const Coord& high, const std::function<double(const Vec3d&)>& rho,
                   double voxel_size = 1, const Vec3d& origin = Vec3d(0)) {
  std::vector<Coord> origins;
  std::vector<BlockMask> masks;
  const Coord first = blockOriginOf(low), last = blockOriginOf(high);
  for (int x = first[0]; x <= last[0]; x += 8)
    for (int y = first[1]; y <= last[1]; y += 8)
      for (int z = first[2]; z <= last[2]; z += 8) {
        BlockMask mask;
        for (int n = 0; n < kBlockVoxels; ++n) {
          const Coord p = Coord(x, y, z) + voxelLocal(n);
          bool inside = true;
          for (int a = 0; a < 3; ++a) inside &= p[a] >= low[a] && p[a] <= high[a];
          if (inside && rho(p.asVec3d()) > 0) mask.setOn(n);
        }
        origins.emplace_back(x, y, z);
        masks.push_back(mask);
      }
  LitVolume lit;
  Volume& density = lit.medium.density;
  density.topology = std::make_shared<Topology>(origins, masks);
  density.transform = Transform::uniform(voxel_size, origin);
  density.values = Field<float>(*density.topology);
  for (size_t b = 0; b < density.topology->blockCount(); ++b)
    for (auto n = density.topology->active(b).beginOn(); n; ++n)
      density.values.block(b)[n.pos()] = static_cast<float>(
          rho((density.topology->origin(b) + voxelLocal(static_cast<int>(n.pos()))).asVec3d()));
  return lit;
}

Field<float> constant(const LitVolume& lit, float value) {
  return Field<float>(lit.medium.topology(), value);
}

LitVolume box(double rho) {  // 20 x 20 x 12 voxels across several blocks and the origin, voxels of 0.25
  return volumeOf(
      {-10, -10, -7}, {9, 9, 4}, [=](const Vec3d&) { return rho; }, 0.25, Vec3d(3, -2, 1));
}
constexpr double kBoxHeight = 12 * 0.25;

/// One pixel straight down through the middle of the box.
Camera downThrough(const LitVolume& lit) {
  CameraSettings settings;
  settings.width = settings.height = 1;
  settings.ortho = 0.1;
  const Transform& transform = lit.medium.transform();
  settings.look_at = transform.toWorld(Vec3d(-0.5, -0.5, -1.5));
  settings.from = *settings.look_at + Vec3d(0, 0, 10);
  return Camera(settings, outline(lit.medium.density));
}

double sum(const Picture& picture) {
  double total = 0;
  for (const Vec3f& p : picture.radiance.pixels) total += luminance(Vec3d(p));
  return total;
}

TEST(Render, BoxTransmitsByBeerLambertPerChannel) {
  for (const bool interpolate : {true, false}) {
    LitVolume lit = box(1.5);
    lit.medium.optics.sigma_s = Vec3d(0.05, 0.3, 1);
    lit.medium.optics.sigma_a = Vec3d(0, 0.1, 0.2);
    RenderSettings settings;
    settings.interpolate = interpolate;
    const Picture picture = render(lit, downThrough(lit), settings);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(picture.transmittance[0][c], std::exp(-lit.medium.optics.sigmaT()[c] * 1.5 * kBoxHeight),
                  1e-5);
    EXPECT_EQ(sum(picture), 0);
  }
}

TEST(Render, OpticalDepthOfATrilinearPeakIsExact) {
  // One voxel: along the space diagonal rho falls as (1-|s|)^3, s in voxels per axis, whose integral is 1/2.
  LitVolume lit = volumeOf({3, 3, 3}, {3, 3, 3}, [](const Vec3d&) { return 1.0; });
  CameraSettings view;
  view.width = view.height = 1;
  view.ortho = 1e-6;
  view.look_at = Vec3d(3, 3, 3);
  view.from = Vec3d(13, 13, 13);
  const Picture picture = render(lit, Camera(view, outline(lit.medium.density)));
  EXPECT_NEAR(picture.transmittance[0][0], std::exp(-std::sqrt(3.0) / 2), 1e-6);
}

TEST(Render, SelfEmissionFillsUpToItsRadiance) {
  for (const bool interpolate : {true, false}) {
    LitVolume lit = box(0.7);
    lit.medium.optics.sigma_s = Vec3d(0);
    lit.medium.optics.sigma_a = Vec3d(0.6);
    lit.medium.optics.emission_scale = 2.5;
    lit.medium.emission = {constant(lit, 2)};
    RenderSettings settings;
    settings.interpolate = interpolate;
    const Picture picture = render(lit, downThrough(lit), settings);
    EXPECT_NEAR(picture.radiance.pixels[0][0], 5 * -std::expm1(-0.6 * 0.7 * kBoxHeight), 1e-5);
  }
}

TEST(Render, ThickFurnaceOfAlbedoOneShowsTheRadianceInside) {
  LitVolume lit =
      volumeOf({0, 0, 0}, {15, 15, 15}, [](const Vec3d& p) { return 1 + 0.5 * std::sin(p[0] + p[2]); });
  lit.diffuse.push_back(constant(lit, 1.25f));
  lit.direct.push_back(constant(lit, 1.75f));
  CameraSettings view;
  view.width = view.height = 24;
  const Picture picture = render(lit, Camera(view, outline(lit.medium.density)));
  double least = 1;
  for (size_t i = 0; i < picture.transmittance.size(); ++i) {
    EXPECT_NEAR(picture.radiance.pixels[i][1], 3 * (1 - picture.transmittance[i][1]), 1e-5);
    least = std::min<double>(least, picture.transmittance[i][1]);
  }
  EXPECT_LT(least, 1e-3);
}

TEST(Render, EdgesOfTheActiveVoxelsDoNotDarkenTheLight) {
  // A thin sheet: everywhere near inactive voxels. Light over opacity is the radiance inside nevertheless.
  LitVolume lit = volumeOf({0, 0, 7}, {30, 30, 8}, [](const Vec3d&) { return 0.2; });
  lit.diffuse.push_back(constant(lit, 2));
  CameraSettings view;
  view.width = view.height = 40;
  const Picture picture = render(lit, Camera(view, outline(lit.medium.density)));
  const std::vector<float> alpha = opacity(picture);
  for (size_t i = 0; i < alpha.size(); ++i) EXPECT_NEAR(picture.radiance.pixels[i][0], 2 * alpha[i], 1e-6);
}

TEST(Render, NothingIsCutOffWhereABlockEnds) {
  // The same ball with its surface inside blocks and touching their faces: the pictures agree.
  const auto ball = [](const Vec3d& centre) {
    LitVolume lit = volumeOf(
        {-16, -16, -16}, {31, 31, 31},
        [=](const Vec3d& p) { return (p - centre).length() < 7.9 ? 1.0 : 0.0; }, 1, -centre);
    lit.medium.optics.sigma_s = Vec3d(0.1);
    lit.diffuse.push_back(constant(lit, 1));
    CameraSettings view;
    view.width = view.height = 48;
    view.ortho = 20;
    view.look_at = Vec3d(0);
    view.from = Vec3d(-13, -31, 9);
    return render(lit, Camera(view, outline(lit.medium.density)));
  };
  const Picture a = ball(Vec3d(8)), b = ball(Vec3d(11));
  for (size_t i = 0; i < a.radiance.pixels.size(); ++i)
    EXPECT_NEAR(a.radiance.pixels[i][0], b.radiance.pixels[i][0], 1e-6) << i;
}

LitVolume gradientBall() {  // looks the same after a quarter turn about z
  LitVolume lit = volumeOf({-12, -12, -12}, {12, 12, 12}, [](const Vec3d& p) {
    return std::max(0.0, 0.3 * (12 - p.length())) * (1 + 0.3 * p[0] * p[0] * p[1] * p[1] / 1000);
  });
  lit.medium.optics.sigma_s = Vec3d(0.2);
  lit.diffuse.push_back(constant(lit, 0));
  const Topology& topology = lit.medium.topology();
  for (size_t b = 0; b < topology.blockCount(); ++b)
    for (int n = 0; n < kBlockVoxels; ++n)
      lit.diffuse[0].block(b)[n] = 1 + 0.05f * (topology.origin(b) + voxelLocal(n))[2];
  return lit;
}

TEST(Render, AQuarterTurnOfTheCameraAboutASymmetricVolumeChangesNothing) {
  const LitVolume lit = gradientBall();
  std::vector<Picture> pictures;
  for (const Vec3d& from : {Vec3d(30, 17, 11), Vec3d(-17, 30, 11), Vec3d(-30, -17, 11), Vec3d(17, -30, 11)}) {
    CameraSettings view;
    view.width = view.height = 32;
    view.from = from;
    view.look_at = Vec3d(0);
    view.fov = 0.9;
    pictures.push_back(render(lit, Camera(view, outline(lit.medium.density))));
  }
  for (int turn = 1; turn < 4; ++turn)
    for (size_t i = 0; i < pictures[0].radiance.pixels.size(); ++i)
      EXPECT_NEAR(pictures[turn].radiance.pixels[i][0], pictures[0].radiance.pixels[i][0], 1e-5);
  EXPECT_GT(sum(pictures[0]), 100);
}

TEST(Render, PerspectiveFromFarAwayIsOrthographic) {
  const LitVolume lit = gradientBall();
  const auto corners = outline(lit.medium.density);
  CameraSettings view;
  view.width = 40;
  view.height = 30;
  view.look_at = Vec3d(1, 2, 0);
  const double distance = 1e5;
  view.from = *view.look_at + Vec3d(0.48, 0.6, 0.64) * distance;
  view.ortho = 30;
  const Picture ortho = render(lit, Camera(view, corners));
  view.fov = 2 * std::atan(*view.ortho / 2 / distance);
  view.ortho.reset();
  const Picture perspective = render(lit, Camera(view, corners));
  for (size_t i = 0; i < ortho.radiance.pixels.size();
       ++i)  // rays diverge by 12/distance of the volume's size
    EXPECT_NEAR(perspective.radiance.pixels[i][0], ortho.radiance.pixels[i][0], 20 / distance);
  EXPECT_GT(sum(ortho), 100);
}

TEST(Render, ForwardFluxBrightensTheSideItFlowsTo) {
  LitVolume lit = box(0.01);  // thin, so that the pixel is the emission times the length
  lit.medium.optics.g = 0.5;
  lit.diffuse.push_back(constant(lit, 1));
  const double flux = 0.8;
  lit.flux = {constant(lit, 0), constant(lit, 0), constant(lit, static_cast<float>(flux))};
  const Picture above = render(lit, downThrough(lit));  // light that travels up reaches a camera above
  const double tau = 0.01 * kBoxHeight, fill = -std::expm1(-tau);
  EXPECT_NEAR(above.radiance.pixels[0][0], fill * (1 + 0.5 * 3 * flux / (4 * kPi)), 1e-6);
  lit.flux[2].fill(-100);  // more than the mean allows: not negative
  EXPECT_EQ(render(lit, downThrough(lit)).radiance.pixels[0][0], 0);
}

TEST(Render, ColouredLightGivesTheFluxItsColour) {
  LitVolume lit = box(0.01);
  lit.medium.optics.g = 0.5;
  for (const float value : {2.0f, 1.0f, 0.5f}) lit.diffuse.push_back(constant(lit, value));
  lit.flux = {constant(lit, 0), constant(lit, 0), constant(lit, 0.8f)};
  const Vec3f pixel = render(lit, downThrough(lit)).radiance.pixels[0];
  EXPECT_NEAR(pixel[0] / pixel[1], 2, 1e-5);
  EXPECT_NEAR(pixel[2] / pixel[1], 0.5, 1e-5);
  const double fill = -std::expm1(-0.01 * kBoxHeight), mean = luminance(Vec3d(2, 1, 0.5));
  EXPECT_NEAR(luminance(Vec3d(pixel)), fill * (mean + 0.5 * 3 * 0.8 / (4 * kPi)), 1e-6);
}

TEST(Render, GreyInThreeChannelsIsGreyInOne) {
  LitVolume lit = gradientBall();
  CameraSettings view;
  view.width = view.height = 16;
  const Camera camera(view, outline(lit.medium.density));
  const Picture one = render(lit, camera);
  lit.diffuse = {lit.diffuse[0], lit.diffuse[0], lit.diffuse[0]};
  const Picture three = render(lit, camera);
  for (size_t i = 0; i < one.radiance.pixels.size(); ++i)
    EXPECT_EQ(one.radiance.pixels[i], three.radiance.pixels[i]);
}

TEST(Render, ThreadsDoNotChangeABit) {
  const LitVolume lit = gradientBall();
  CameraSettings view;
  view.width = 50;
  view.height = 34;
  const Camera camera(view, outline(lit.medium.density));
  const Picture many = render(lit, camera);
  tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(render(lit, camera).radiance.pixels, many.radiance.pixels);
}

TEST(Render, EdgesAreCoveredByTheirShareOfThePixel) {
  // The box is 3 pixels wide in a picture of 4: stratified rays give 1/2 on its sides, 1/4 on its corners.
  const LitVolume lit = box(100);
  CameraSettings view;
  view.width = view.height = 4;
  view.ortho = 20 * 0.25 * 4 / 3;
  view.look_at = lit.medium.transform().toWorld(Vec3d(-0.5, -0.5, -1.5));
  view.from = *view.look_at + Vec3d(0, 0, 10);
  RenderSettings settings;
  settings.interpolate = false;
  const std::vector<float> alpha = opacity(render(lit, Camera(view, outline(lit.medium.density)), settings));
  const double share[4] = {0.5, 1, 1, 0.5};
  for (int i = 0; i < 16; ++i) EXPECT_NEAR(alpha[i], share[i % 4] * share[i / 4], 1e-6);
}

TEST(Render, ConvergesUnderMoreSamplesToTheSameLight) {
  const LitVolume lit = gradientBall();
  CameraSettings view;
  view.width = view.height = 16;
  const Camera camera(view, outline(lit.medium.density));
  RenderSettings coarse, fine;
  coarse.samples = 4;
  fine.samples = 12;
  EXPECT_NEAR(sum(render(lit, camera, coarse)) / sum(render(lit, camera, fine)), 1, 0.002);
}

TEST(Render, VoxelAnisotropyAndRotationKeepOpticalDepth) {
  // Rotated axes with voxels of 0.5 x 1 x 2: a ray along the third axis crosses 12 voxels of 2.
  LitVolume lit = box(0.1);
  const double c = std::cos(0.7), s = std::sin(0.7);
  lit.medium.density.transform =
      Transform(Vec3d(0.5 * c, 0.5 * s, 0), Vec3d(-s, c, 0), Vec3d(0, 0, -2), Vec3d(5, 5, 5));
  const Picture picture = render(lit, downThrough(lit));
  EXPECT_NEAR(picture.transmittance[0][0], std::exp(-0.1 * 24), 1e-5);
}

TEST(Picture, BackgroundShowsThroughByTheTransmittance) {
  Picture picture;
  picture.radiance = {1, 1, {Vec3f(1, 2, 3)}};
  picture.transmittance = {Vec3f(1, 0.5f, 0)};
  EXPECT_EQ(over(picture, Vec3d(10, 10, 10)).pixels[0], Vec3f(11, 7, 3));
  EXPECT_NEAR(opacity(picture)[0], 0.5, 1e-6);
}

TEST(Picture, AutomaticExposureBringsTheBrightPartNearWhite) {
  Image image{100, 10, std::vector<Vec3f>(1000, Vec3f(0))};
  EXPECT_EQ(automaticExposure(image), 0);
  for (int i = 0; i < 500; ++i) image.pixels[i] = Vec3f(0.05f);
  EXPECT_NEAR(0.05 * std::exp2(automaticExposure(image)), 0.8, 1e-6);
  image.pixels[7] = Vec3f(1e6);  // one hot pixel does not rule
  EXPECT_NEAR(0.05 * std::exp2(automaticExposure(image)), 0.8, 1e-6);
}

}  // namespace
}  // namespace vdb_diffuse
