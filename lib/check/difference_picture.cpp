#include "check/difference_picture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "plot/colour_map.h"

namespace vdb_diffuse {
namespace {

constexpr int kPanel = 480;  // pixels to a side, at most
constexpr int kMargin = 24, kHeader = 96, kFooter = 84, kBar = 14;
constexpr Colour kInk{0.15, 0.15, 0.15};

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

double largest(const std::vector<float>& values) {
  double most = 0;
  for (const float v : values)
    if (std::isfinite(v)) most = std::max(most, static_cast<double>(std::abs(v)));
  return most;
}

int worstComponent(const GridValues& stored, const GridValues& now, const Coord& worst) {
  const size_t count = std::max(stored.channels.size(), now.channels.size());
  SlicePlane point;
  point.lowest = point.highest = worst;
  int found = 0;
  double most = -1;
  for (size_t c = 0; c < count; ++c) {
    const int component = static_cast<int>(c);
    const double d =
        std::abs(sliceValues(now, component, point)[0] - sliceValues(stored, component, point)[0]);
    if (d > most) {
      most = d;
      found = component;
    }
  }
  return found;
}

/// Squares of `side` pixels, each for one voxel or, of many, for the worst of `stride` x `stride`.
struct Raster {
  int width, height, side, stride;

  explicit Raster(const SlicePlane& plane) : width(plane.width()), height(plane.height()) {
    stride = std::max(1, (std::max(width, height) + kPanel - 1) / kPanel);
    side = std::max(1, kPanel * stride / std::max(width, height));
    side = stride > 1 ? 1 : std::min(side, kPanel / 8);  // a few voxels need no sheet full of squares
  }
  int columns() const { return (width + stride - 1) / stride; }
  int rows() const { return (height + stride - 1) / stride; }

  /// The voxel, of those under a square, whose difference is largest.
  size_t pick(int column, int row, const std::vector<float>& difference) const {
    size_t best = static_cast<size_t>(row) * stride * width + static_cast<size_t>(column) * stride;
    for (int v = row * stride; v < std::min(height, (row + 1) * stride); ++v)
      for (int u = column * stride; u < std::min(width, (column + 1) * stride); ++u) {
        const size_t i = static_cast<size_t>(v) * width + u;
        if (std::abs(difference[i]) > std::abs(difference[best])) best = i;
      }
    return best;
  }
};

std::vector<Point> corners(const Box& box) {
  return {{box.left, box.top}, {box.right(), box.top}, {box.right(), box.bottom()}, {box.left, box.bottom()}};
}

}  // namespace

std::string differencePicture(const GridValues& stored, const GridValues& now, const Coord& worst,
                              const DifferenceWords& words) {
  const SlicePlane plane = sliceThrough(worst, *stored.topology, *now.topology);
  const int component = worstComponent(stored, now, worst);
  const std::vector<float> a = sliceValues(stored, component, plane), b = sliceValues(now, component, plane);
  std::vector<float> d(a.size());
  for (size_t i = 0; i < d.size(); ++i) d[i] = b[i] - a[i];
  const double brightest = std::max(largest(a), largest(b)), apart = largest(d);

  const Raster raster(plane);
  const int wide = raster.columns() * raster.side, high = raster.rows() * raster.side;
  const int column = std::max(wide, 220);  // room for words over a narrow slice
  Canvas canvas(PictureFormat::kPng, 3 * column + 4 * kMargin, high + kHeader + kFooter);
  canvas.text(words.title, {kMargin, 32}, TextStyle{20, kInk, true});
  canvas.text(words.subtitle, {kMargin, 56}, TextStyle{14, kInk});

  const char axes[] = "xyz";
  const std::string place = std::string(" (") + axes[plane.normal] + " = " +
                            std::to_string(worst[plane.normal] * words.block) + ", " + axes[plane.right] +
                            " right, " + axes[plane.up] + " up)";
  const char* components[] = {"", "", ""};
  const char* coloured[] = {", first component", ", second component", ", third component"};
  const bool several = std::max(stored.channels.size(), now.channels.size()) > 1;
  const std::string titles[] = {
      "stored" + place, std::string("now") + (several ? coloured : components)[component], "now - stored"};
  for (int panel = 0; panel < 3; ++panel) {
    const double left = kMargin + panel * (column + kMargin);
    canvas.text(titles[panel], {left, kHeader - 12}, TextStyle{14, kInk});
    for (int row = 0; row < raster.rows(); ++row)
      for (int n = 0; n < raster.columns(); ++n) {
        const size_t i = raster.pick(n, row, d);
        const Colour colour =
            panel == 2 ? colourOf(kDifferenceMap, apart > 0 ? 0.5 + 0.5 * d[i] / apart : 0.5)
                       : colourOf(kLightMap, brightest > 0 ? (panel == 0 ? a : b)[i] / brightest : 0);
        canvas.area(corners({left + n * raster.side, static_cast<double>(kHeader + row * raster.side),
                             static_cast<double>(raster.side), static_cast<double>(raster.side)}),
                    colour);
      }
    const double x = left + (worst[plane.right] - plane.lowest[plane.right]) / raster.stride * raster.side;
    const double y = kHeader + (plane.highest[plane.up] - worst[plane.up]) / raster.stride * raster.side;
    std::vector<Point> frame = corners({x - 3, y - 3, raster.side + 6.0, raster.side + 6.0});
    frame.push_back(frame[0]);
    canvas.line(frame, {{0, 0.62, 0.45}, 2});
  }
  const double bar = kHeader + high + 16;
  drawColourBar(canvas, {kMargin, bar, 2.0 * column + kMargin, kBar}, kLightMap, "0", number(brightest));
  drawColourBar(canvas, {2.0 * column + 3 * kMargin, bar, static_cast<double>(column), kBar}, kDifferenceMap,
                number(-apart), number(apart));
  return canvas.finish();
}

}  // namespace vdb_diffuse
