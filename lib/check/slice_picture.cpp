#include "check/slice_picture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <tuple>

#include "grid/error.h"
#include "plot/colour_map.h"

namespace vdb_diffuse {
namespace {

constexpr int kLargest = 1600, kSmallest = 320;  // pixels to a side of the slice
constexpr int kMargin = 24, kHeader = 76, kFooter = 76, kBar = 14;
constexpr Colour kInk{0.15, 0.15, 0.15}, kNoVoxel{0.87, 0.88, 0.9};
constexpr char kAxes[] = "xyz";

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

/// The voxel axis nearest to an axis of the world.
int nearestAxis(const Transform& transform, int world_axis) {
  int nearest = 0;
  double most = -1;
  for (int a = 0; a < 3; ++a) {
    const double along = std::abs(transform.axis(a)[world_axis]) / transform.axis(a).length();
    if (along > most + 1e-9) {
      most = along;
      nearest = a;
    }
  }
  return nearest;
}

/// One number for each voxel of the plane.
std::vector<float> shownValues(const GridValues& grid, const SlicePlane& plane, bool length) {
  std::vector<float> shown = sliceValues(grid, 0, plane);
  if (grid.channels.size() == 1) return shown;
  const std::vector<float> y = sliceValues(grid, 1, plane), z = sliceValues(grid, 2, plane);
  for (size_t i = 0; i < shown.size(); ++i)
    shown[i] =
        length ? std::hypot(shown[i], y[i], z[i]) : 0.2126f * shown[i] + 0.7152f * y[i] + 0.0722f * z[i];
  return shown;
}

std::pair<double, double> rangeOf(const std::vector<float>& values, const SliceSettings& settings) {
  double low = 0, high = 0;
  for (const float v : values) {
    if (!std::isfinite(v)) continue;
    low = std::min(low, static_cast<double>(v));
    high = std::max(high, static_cast<double>(v));
  }
  return {settings.low.value_or(low), settings.high.value_or(high)};
}

std::string placeOf(const GridValues& grid, const SlicePlane& plane, int axis) {
  const Transform& transform = grid.transform;
  const auto name = [&](int index_axis) {
    for (int a = 0; a < 3; ++a)
      if (nearestAxis(transform, a) == index_axis) return std::string(1, kAxes[a]);
    return "voxel axis " + std::string(1, kAxes[index_axis]);
  };
  const double at = transform.toWorld(plane.lowest.asVec3d())[axis];
  return std::string(1, kAxes[axis]) + " = " + number(at) + ", " + name(plane.right) + " to the right, " +
         name(plane.up) + " up; " + std::to_string(plane.width()) + " x " + std::to_string(plane.height()) +
         " voxels of " + number(transform.meanVoxelSize());
}

}  // namespace

SlicePlane slicePlane(const GridValues& grid, const SliceSettings& settings) {
  if (grid.topology->activeVoxelCount() == 0)
    throw InputError("has no active voxels: there is nothing to see");
  SlicePlane plane;
  std::tie(plane.lowest, plane.highest) = grid.topology->activeBox();
  plane.normal = nearestAxis(grid.transform, settings.axis);
  plane.right = plane.normal == 0 ? 1 : 0;
  plane.up = plane.normal == 2 ? 1 : 2;
  const Vec3d middle = (plane.lowest.asVec3d() + plane.highest.asVec3d()) * 0.5;
  double at = middle[plane.normal];
  if (settings.at) {
    Vec3d p_world = grid.transform.toWorld(middle);
    p_world[settings.axis] = *settings.at;
    at = grid.transform.toIndex(p_world)[plane.normal];
  }
  if (!(at >= plane.lowest[plane.normal] - 0.5 && at <= plane.highest[plane.normal] + 0.5)) {
    Coord low = plane.lowest, high = plane.highest;
    const double from = grid.transform.toWorld(low.asVec3d())[settings.axis];
    const double to = grid.transform.toWorld(high.asVec3d())[settings.axis];
    throw InputError("no active voxels at " + std::string(1, kAxes[settings.axis]) + " = " +
                     number(*settings.at) + "; they lie from " + number(std::min(from, to)) + " to " +
                     number(std::max(from, to)));
  }
  const int voxel = std::clamp(static_cast<int>(std::floor(at + 0.5)), plane.lowest[plane.normal],
                               plane.highest[plane.normal]);
  plane.lowest[plane.normal] = plane.highest[plane.normal] = voxel;
  return plane;
}

std::string slicePicture(const GridValues& grid, const SliceSettings& settings) {
  const SlicePlane plane = slicePlane(grid, settings);
  const std::vector<float> values = shownValues(grid, plane, settings.length);
  const auto [low, high] = rangeOf(values, settings);

  const int longest = std::max(plane.width(), plane.height());
  const int stride = (longest + kLargest - 1) / kLargest;
  const int columns = (plane.width() + stride - 1) / stride, rows = (plane.height() + stride - 1) / stride;
  const int side = std::max(1, kLargest / 2 / std::max(columns, rows));
  std::vector<Colour> colours;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const double v =
          values[static_cast<size_t>(row) * stride * plane.width() + static_cast<size_t>(column) * stride];
      const double share = high > low ? (v - low) / (high - low) : std::isfinite(v) ? v > high : v;
      Coord p = plane.lowest;
      p[plane.right] += column * stride;
      p[plane.up] = plane.highest[plane.up] - row * stride;
      colours.push_back(grid.topology->isActive(p) ? colourOf(kLightMap, share) : kNoVoxel);
    }
  const int wide = columns * side, tall = rows * side;
  const TextStyle large{18, kInk, true}, small{13, kInk};
  const std::string place = placeOf(grid, plane, settings.axis);
  const Canvas ruler(PictureFormat::kPng, 1, 1);
  const double words = std::max(ruler.textWidth(settings.title, large), ruler.textWidth(place, small));
  const int sheet = std::max({wide, kSmallest, static_cast<int>(std::ceil(words))});
  Canvas canvas(PictureFormat::kPng, sheet + 2 * kMargin, tall + kHeader + kFooter);
  canvas.text(settings.title, {kMargin, 32}, large);
  canvas.text(place, {kMargin, 56}, small);
  canvas.pixels({kMargin, kHeader, static_cast<double>(wide), static_cast<double>(tall)}, columns, rows,
                colours);
  const std::string unit = settings.unit.empty() ? "" : " " + settings.unit;
  drawColourBar(canvas, {kMargin, kHeader + tall + 16.0, static_cast<double>(sheet), kBar}, kLightMap,
                number(low), number(high) + unit);
  return canvas.finish();
}

}  // namespace vdb_diffuse
