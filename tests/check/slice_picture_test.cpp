#include "check/slice_picture.h"

#include <gtest/gtest.h>

#include "cli/png_pixels.h"
#include "grid/error.h"
#include "plot/colour_map.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

/// 10 x 6 x 4 voxels, but for one, of side 0.5 about the origin of the world's numbers 20, 30, 40; value x +
/// 10 y + 100 z.
GridValues ramp(const Transform& transform = Transform::uniform(0.5, Vec3d(20, 30, 40))) {
  const Medium medium = boxMedium(Coord(10, 6, 4), transform, [](Coord p) {
    return p == Coord(7, 1, 1) ? -1 : p[0] + 10.0 * p[1] + 100.0 * p[2];
  });
  GridValues grid;
  grid.topology = medium.density.topology;
  grid.transform = transform;
  grid.channels.push_back(medium.density.values);
  return grid;
}

SliceSettings across(int axis, std::optional<double> at = {}) {
  SliceSettings settings;
  settings.axis = axis;
  settings.at = at;
  return settings;
}

TEST(SlicePlane, IsTheLayerOfVoxelsAtThePlace) {
  const SlicePlane z = slicePlane(ramp(), across(2, 41.1));  // voxels at 40, 40.5, 41, 41.5
  EXPECT_EQ(z.normal, 2);
  EXPECT_EQ(z.lowest, Coord(0, 0, 2));
  EXPECT_EQ(z.highest, Coord(9, 5, 2));
  EXPECT_EQ(slicePlane(ramp(), across(0)).lowest[0], 5) << "the middle, 4.5, is as near to 4";
  EXPECT_EQ(slicePlane(ramp(), across(1, 29.76)).lowest[1], 0);
  EXPECT_EQ(slicePlane(ramp(), across(1, 32.74)).lowest[1], 5);
  EXPECT_THROW(slicePlane(ramp(), across(1, 29.7)), InputError);
  EXPECT_THROW(slicePlane(ramp(), across(1, 32.8)), InputError);
  EXPECT_THROW(slicePlane(GridValues{}, across(1)), InputError);
}

TEST(SlicePlane, FollowsTheWorldsAxisWhereVoxelsAreTurned) {
  const Transform quarter(Vec3d(0, 0.5, 0), Vec3d(-0.5, 0, 0), Vec3d(0, 0, 0.5), Vec3d(0));
  const SlicePlane plane = slicePlane(ramp(quarter), across(1, 2.1));  // voxel axis x runs along y
  EXPECT_EQ(plane.normal, 0);
  EXPECT_EQ(plane.lowest[0], 4);
}

// The picture's squares have the colours of the values at their places.
TEST(SlicePicture, ColoursAreThoseOfTheValues) {
  SliceSettings settings = across(2, 40.5);
  settings.low = 100;
  settings.high = 160;
  const PngPixels png = pixelsOf(slicePicture(ramp(), settings));
  const int side = 80;  // half of the largest picture over ten voxels
  for (const auto& [column, row] : {std::pair(0, 0), std::pair(9, 0), std::pair(4, 3), std::pair(9, 5)}) {
    const double value = column + 10.0 * (5 - row) + 100;  // the uppermost row is the highest y
    const Colour expected = colourOf(kLightMap, (value - 100) / 60);
    const std::array<int, 3> found = png.at(24 + column * side + side / 2, 76 + row * side + side / 2);
    EXPECT_NEAR(found[0], 255 * expected.red, 1) << column << ", " << row;
    EXPECT_NEAR(found[1], 255 * expected.green, 1) << column << ", " << row;
    EXPECT_NEAR(found[2], 255 * expected.blue, 1) << column << ", " << row;
  }
  const std::array<int, 3> hole = png.at(24 + 7 * side + side / 2, 76 + 4 * side + side / 2);
  EXPECT_NEAR(hole[0], 255 * 0.87, 1) << "grey, where there is no voxel";
}

TEST(SlicePicture, OfVectorsShowsTheLengthOrTheLuminance) {
  GridValues grid = ramp();
  for (const float v : {3.f, 4.f}) {
    grid.channels.emplace_back(*grid.topology, v);
  }
  for (size_t i = 0; i < grid.channels[0].size(); ++i) grid.channels[0][i] = 0;
  SliceSettings settings = across(2);
  settings.low = 0;
  settings.high = 10;
  const auto middle = [&] { return pixelsOf(slicePicture(grid, settings)).at(24 + 40, 76 + 40); };
  EXPECT_NEAR(middle()[0], 255 * colourOf(kLightMap, (0.7152 * 3 + 0.0722 * 4) / 10).red, 1);
  settings.length = true;
  EXPECT_NEAR(middle()[0], 255 * colourOf(kLightMap, 0.5).red, 1);
}

}  // namespace
}  // namespace vdb_diffuse
