#include "plot/chart.h"

#include <gtest/gtest.h>
#include <png.h>

#include <cmath>
#include <set>

#include "io/expect_error.h"
#include "plot/label_places.h"
#include "plot/layout.h"

namespace vdb_diffuse {
namespace {

/// y = x^2 from 0.1 to 10 on logarithmic axes: a straight line.
Chart parabola() {
  Chart chart;
  chart.title = "Squares & <roots>";
  chart.x.label = "x (m)";
  chart.y.label = "y (m²)";
  chart.x.scale = chart.y.scale = Scale::kLog;
  Series curve;
  curve.name = "the curve";
  for (int i = 0; i <= 40; ++i) {
    curve.x.push_back(0.1 * std::pow(10.0, 0.05 * i));
    curve.y.push_back(curve.x.back() * curve.x.back());
  }
  chart.series.push_back(curve);
  return chart;
}

struct Pixels {
  int width = 0, height = 0;
  std::vector<uint8_t> rgb;
  /// Colourful, that is, neither white, ink nor grid.
  bool coloured(int x, int y) const {
    const uint8_t* p = rgb.data() + 3 * (static_cast<size_t>(y) * width + x);
    return std::abs(p[2] - p[0]) > 60;
  }
};

Pixels decoded(const std::string& bytes) {
  png_image png = {};
  png.version = PNG_IMAGE_VERSION;
  EXPECT_TRUE(png_image_begin_read_from_memory(&png, bytes.data(), bytes.size())) << png.message;
  png.format = PNG_FORMAT_RGB;
  Pixels pixels{static_cast<int>(png.width), static_cast<int>(png.height), {}};
  pixels.rgb.resize(PNG_IMAGE_SIZE(png));
  EXPECT_TRUE(png_image_finish_read(&png, nullptr, pixels.rgb.data(), 0, nullptr)) << png.message;
  return pixels;
}

/// Every tag is closed by its own, and nothing stands open: enough of XML for what a chart is made of.
bool tagsMatch(const std::string& xml) {
  std::vector<std::string> open;
  for (size_t at = xml.find('<'); at != std::string::npos; at = xml.find('<', at + 1)) {
    const size_t end = xml.find('>', at);
    if (end == std::string::npos || xml.find('<', at + 1) < end) return false;
    std::string tag = xml.substr(at + 1, end - at - 1);
    if (tag[0] == '?' || tag.back() == '/') continue;
    const bool closes = tag[0] == '/';
    tag = tag.substr(closes, tag.find_first_of(" \n") - closes);
    if (!closes)
      open.push_back(tag);
    else if (open.empty() || open.back() != tag)
      return false;
    else
      open.pop_back();
  }
  return open.empty();
}

TEST(Chart, SvgIsXmlThatHoldsItsWords) {
  const std::string svg = drawChart(parabola(), PictureFormat::kSvg);
  EXPECT_NE(svg.find("<svg"), std::string::npos);
  EXPECT_TRUE(tagsMatch(svg));
  EXPECT_NE(svg.find("<title>Squares &amp; &lt;roots&gt;</title>"), std::string::npos);
  for (const std::string words : {"x (m)", "y (m²)", "the curve", "; 0.1;", "; 10;"})
    EXPECT_NE(svg.find(words), std::string::npos) << words;
  EXPECT_EQ(svg.find("viewBox=\"0 0 1600 1000\"") == std::string::npos, false);
}

TEST(Chart, PngHasItsSizeAndTheCurveLiesWhereTheDataSays) {
  for (const auto& [width, height] : {std::pair<int, int>(1600, 1000), {640, 480}}) {
    Chart chart = parabola();
    chart.width = width;
    chart.height = height;
    chart.series[0].name.clear();  // so that the only colour is the curve's
    const Pixels pixels = decoded(drawChart(chart, PictureFormat::kPng));
    ASSERT_EQ(pixels.width, width);
    ASSERT_EQ(pixels.height, height);
    const Layout layout = layOut(chart);
    int columns = 0;
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      int count = 0;
      for (int y = 0; y < height; ++y)
        if (pixels.coloured(x, y)) sum += y + 0.5, ++count;
      const double along = (x + 0.5 - layout.frame.left) / layout.frame.width;
      const double value = layout.x.low * std::pow(layout.x.high / layout.x.low, along);
      if (count == 0) {
        EXPECT_TRUE(value < 0.101 || value > 9.9) << value;
        continue;
      }
      ++columns;
      if (value < 0.105 || value > 9.5) continue;  // the round ends
      const double up = std::log(value * value / layout.y.low) / std::log(layout.y.high / layout.y.low);
      EXPECT_NEAR(sum / count, layout.frame.bottom() - up * layout.frame.height, 0.75) << x;
    }
    EXPECT_GT(columns, 0.8 * layout.frame.width);
  }
}

TEST(Chart, TwoOfAKindAreTheSameBytes) {
  for (const PictureFormat format : {PictureFormat::kSvg, PictureFormat::kPng})
    EXPECT_EQ(drawChart(parabola(), format), drawChart(parabola(), format));
}

TEST(Chart, RefusesWhatCannotBeDrawn) {
  const auto draw = [](const Chart& chart) { return [&] { drawChart(chart, PictureFormat::kPng); }; };
  Chart chart = parabola();
  chart.series[0].y[3] = 0;
  expectError(ExitStatus::kInputRefused, {"Squares", "the curve", "0", "logarithmic"}, draw(chart));
  chart.y.scale = Scale::kLinear;
  drawChart(chart, PictureFormat::kPng);
  chart.series[0].y[3] = NAN;
  expectError(ExitStatus::kInputRefused, {"the curve", "nan"}, draw(chart));
  chart = parabola();
  chart.x.low = -1;
  expectError(ExitStatus::kInputRefused, {"x (m)", "-1", "logarithmic"}, draw(chart));
  chart = parabola();
  chart.x.low = 3;
  chart.x.high = 3;
  expectError(ExitStatus::kInputRefused, {"x (m)"}, draw(chart));
  chart = parabola();
  chart.series[0].x.pop_back();
  expectError(ExitStatus::kInputRefused, {"the curve", "lengths"}, draw(chart));
  chart = parabola();
  chart.width = 50;
  expectError(ExitStatus::kInputRefused, {"pixels"}, draw(chart));
  expectError(ExitStatus::kUsage, {"out.pdf", ".svg"}, [] { pictureFormatOf("out.pdf"); });
  EXPECT_EQ(pictureFormatOf("a/b.SVG"), PictureFormat::kSvg);
}

TEST(Chart, DrawsNothingAtAllAndBytesThatAreNoText) {
  Chart chart;
  chart.title = "\xff\xc3x\xe2\x82 \xed\xa0\x80 fine";
  const std::string svg = drawChart(chart, PictureFormat::kSvg);
  EXPECT_NE(svg.find("<title>??x?? ??? fine</title>"), std::string::npos) << svg.substr(0, 400);
}

TEST(LabelPlaces, KeepOffEachOtherThePointsAndTheEdge) {
  const Box frame{0, 0, 1000, 600};
  std::vector<LabelWish> wishes;
  std::vector<Box> obstacles;
  for (int i = 0; i < 12; ++i) {  // a crowd in a corner
    const Point p{900 + 90 * std::sin(2.4 * i), 60 + 50 * std::cos(1.7 * i)};
    wishes.push_back({120, 24, {p}, 10});
    obstacles.push_back({p.x - 8, p.y - 8, 16, 16});
  }
  const std::vector<LabelPlace> places = placeLabels(wishes, obstacles, frame);
  const auto apart = [](const Box& a, const Box& b) {
    return a.right() <= b.left || b.right() <= a.left || a.bottom() <= b.top || b.bottom() <= a.top;
  };
  for (size_t i = 0; i < places.size(); ++i) {
    EXPECT_TRUE(frame.holds(places[i].box)) << i;
    for (size_t j = 0; j < i; ++j) EXPECT_TRUE(apart(places[i].box, places[j].box)) << i << ", " << j;
    for (const Box& point : obstacles) EXPECT_TRUE(apart(places[i].box, point)) << i;
  }
}

}  // namespace
}  // namespace vdb_diffuse
