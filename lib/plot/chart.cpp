#include "plot/chart.h"

#include <algorithm>
#include <cmath>

#include "plot/label_places.h"
#include "plot/layout.h"

namespace vdb_diffuse {
namespace {

// Okabe and Ito (2008), without yellow, which is too faint on white.
constexpr Colour kPalette[] = {{0.00, 0.45, 0.70}, {0.84, 0.37, 0.00}, {0.00, 0.62, 0.45}, {0.80, 0.47, 0.65},
                               {0.90, 0.62, 0.00}, {0.34, 0.71, 0.91}, {0.10, 0.10, 0.10}};
constexpr size_t kColours = sizeof kPalette / sizeof kPalette[0];
constexpr Colour kInk{0.13, 0.13, 0.13}, kFaintInk{0.38, 0.38, 0.38}, kGrid{0.90, 0.90, 0.90},
    kBand{0.45, 0.45, 0.45, 0.16};
// Sizes, in units of the layout.
constexpr double kTitle = 36, kSubtitle = 23, kAxisLabel = 26, kTickLabel = 23, kName = 25, kLabel = 22;
constexpr double kLine = 3.5, kThin = 1.6, kMarker = 9, kPadding = 5;

Colour darker(const Colour& c) {
  return {0.8 * c.red, 0.8 * c.green, 0.8 * c.blue, c.alpha};
}

Box boxAbout(const Point& p, double radius) {
  return {p.x - radius, p.y - radius, 2 * radius, 2 * radius};
}

/// Points along a polyline, at most `step` apart, the last first.
std::vector<Point> sampled(const std::vector<Point>& line, double step) {
  std::vector<Point> samples;
  for (size_t i = line.size(); i-- > 1;) {
    const Point &a = line[i], &b = line[i - 1];
    const int parts = 1 + static_cast<int>(std::hypot(b.x - a.x, b.y - a.y) / step);
    for (int k = 0; k < parts; ++k) {
      const double t = static_cast<double>(k) / parts;
      samples.push_back({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)});
    }
  }
  if (!line.empty()) samples.push_back(line.front());
  return samples;
}

class Painter {
 public:
  Painter(const Chart& chart, PictureFormat format)
      : chart_(chart),
        layout_(layOut(chart)),
        u_(layout_.unit),
        frame_(layout_.frame),
        canvas_(format, chart.width, chart.height) {}

  std::string draw() {
    drawTitle();
    drawBands();
    drawAxis(true);
    drawAxis(false);
    nameBands();
    canvas_.clip(frame_);
    for (size_t n = 0; n < chart_.series.size(); ++n) drawLine(chart_.series[n], colourOf(n));
    for (const Span& span : chart_.spans) drawSpan(span);
    for (size_t n = 0; n < chart_.series.size(); ++n) drawMarkers(chart_.series[n], colourOf(n));
    canvas_.unclip();
    drawFrame();
    wishLabels();
    drawLabels();
    return canvas_.finish();
  }

 private:
  const Chart& chart_;
  const Layout layout_;
  const double u_;
  const Box frame_;
  Canvas canvas_;
  std::vector<Box> obstacles_;
  std::vector<LabelWish> wishes_;
  std::vector<std::pair<std::string, TextStyle>> texts_;  // of the wishes

  Colour colourOf(size_t n) const {
    const int chosen = chart_.series[n].colour;
    return kPalette[(chosen >= 0 ? static_cast<size_t>(chosen) : n) % kColours];
  }

  bool inFrame(const Point& p) const { return frame_.holds(boxAbout(p, 0)); }

  std::vector<Point> pointsOf(const Series& s) const {
    std::vector<Point> points;
    for (size_t i = 0; i < s.x.size(); ++i) points.push_back(layout_.at(s.x[i], s.y[i]));
    return points;
  }

  /// Height of a value on the sheet; what lies beyond the axis, or on no logarithmic one, is at its end.
  double heightOf(double y) const {
    return layout_.at(layout_.x.low, std::clamp(y, layout_.y.low, layout_.y.high)).y;
  }

  void drawTitle() {
    const double baseline = 58 * u_;
    canvas_.text(chart_.title, {frame_.left, baseline}, {kTitle * u_, kInk, true});
    canvas_.text(chart_.subtitle, {frame_.left, baseline + (chart_.title.empty() ? 0 : 40 * u_)},
                 {kSubtitle * u_, kFaintInk});
  }

  void drawBands() {
    for (const Band& band : chart_.bands) {
      const double top = heightOf(band.high), bottom = heightOf(band.low);
      canvas_.area(
          {{frame_.left, bottom}, {frame_.right(), bottom}, {frame_.right(), top}, {frame_.left, top}},
          kBand);
      canvas_.line({{frame_.left, top}, {frame_.right(), top}}, {kBand.withAlpha(0.6), kThin * u_});
    }
  }

  /// In the strip, below its upper edge.
  void nameBands() {
    for (const Band& band : chart_.bands) {
      const TextStyle style{kLabel * u_, kFaintInk, false, AlignX::kLeft, AlignY::kMiddle};
      const double height = 1.5 * style.size;
      const Box box{frame_.left + 12 * u_, std::min(heightOf(band.high) + 2 * u_, frame_.bottom() - height),
                    canvas_.textWidth(band.label, style), height};
      canvas_.text(band.label, {box.left, box.top + 0.5 * height}, style);
      obstacles_.push_back(box);
    }
  }

  void drawAxis(bool along_x) {
    const Axis& axis = along_x ? chart_.x : chart_.y;
    const Range& range = along_x ? layout_.x : layout_.y;
    const int most =
        std::max(2, static_cast<int>(along_x ? frame_.width / (125 * u_) : frame_.height / (75 * u_)));
    for (const Tick& tick : ticksOf(axis.scale, range.low, range.high, most)) {
      const Point p = along_x ? Point{layout_.at(tick.value, layout_.y.low).x, frame_.bottom()}
                              : Point{frame_.left, layout_.at(layout_.x.low, tick.value).y};
      const double length = (tick.label.empty() ? 5 : 10) * u_;
      if (!tick.label.empty())
        canvas_.line({p, along_x ? Point{p.x, frame_.top} : Point{frame_.right(), p.y}}, {kGrid, kThin * u_});
      canvas_.line({p, along_x ? Point{p.x, p.y + length} : Point{p.x - length, p.y}}, {kInk, kThin * u_});
      TextStyle style{kTickLabel * u_, kInk};
      style.x = along_x ? AlignX::kMiddle : AlignX::kRight;
      style.y = AlignY::kMiddle;
      canvas_.text(tick.label, along_x ? Point{p.x, p.y + 28 * u_} : Point{p.x - 16 * u_, p.y}, style);
    }
    TextStyle style{kAxisLabel * u_, kInk};
    style.x = AlignX::kMiddle;
    style.y = AlignY::kMiddle;
    style.upwards = !along_x;
    canvas_.text(axis.label,
                 along_x ? Point{frame_.left + frame_.width / 2, frame_.bottom() + 78 * u_}
                         : Point{30 * u_, frame_.top + frame_.height / 2},
                 style);
  }

  void drawFrame() {
    canvas_.line(
        {{frame_.left, frame_.top}, {frame_.left, frame_.bottom()}, {frame_.right(), frame_.bottom()}},
        {kInk, kThin * u_});
  }

  void drawLine(const Series& s, const Colour& colour) {
    const std::vector<Point> points = pointsOf(s);
    if (s.error_band && !s.y_error.empty()) {
      std::vector<Point> edge;
      for (size_t i = 0; i < points.size(); ++i)
        edge.push_back({points[i].x, heightOf(s.y[i] + s.y_error[i])});
      for (size_t i = points.size(); i-- > 0;) edge.push_back({points[i].x, heightOf(s.y[i] - s.y_error[i])});
      canvas_.area(edge, colour.withAlpha(0.2));
    }
    if (s.stroke == Stroke::kNone || points.size() < 2) return;
    const bool dashed = s.stroke == Stroke::kDashed;
    canvas_.line(points, {colour, (dashed ? 2.2 : kLine) * u_, dashed});
    for (const Point& p : sampled(points, 8 * u_)) obstacles_.push_back(boxAbout(p, kLine * u_));
  }

  void drawMarkers(const Series& s, const Colour& colour) {
    const std::vector<Point> points = pointsOf(s);
    for (size_t i = 0; i < points.size(); ++i) {
      if (!s.y_error.empty() && !s.error_band) {
        const double top = heightOf(s.y[i] + s.y_error[i]), bottom = heightOf(s.y[i] - s.y_error[i]);
        const Pen pen{colour, 2 * u_};
        const double x = points[i].x, cap = 6 * u_;
        canvas_.line({{x, top}, {x, bottom}}, pen);
        for (const double y : {top, bottom}) canvas_.line({{x - cap, y}, {x + cap, y}}, pen);
        obstacles_.push_back({x - cap, top, 2 * cap, bottom - top});
      }
      if (s.marker == Marker::kNone) continue;
      drawMarker(points[i], s.marker, (kMarker + 2.5) * u_, {1, 1, 1});
      drawMarker(points[i], s.marker, kMarker * u_, colour);
      if (s.marker == Marker::kRing) canvas_.disc(points[i], 0.55 * kMarker * u_, {1, 1, 1});
      if (inFrame(points[i])) obstacles_.push_back(boxAbout(points[i], (kMarker + 1) * u_));
    }
  }

  void drawMarker(const Point& p, Marker marker, double r, const Colour& colour) {
    const double x = p.x, y = p.y, s = 0.89 * r, d = 1.25 * r, t = 1.2 * r;  // of about the disc's area
    switch (marker) {
      case Marker::kSquare:
        return canvas_.area({{x - s, y - s}, {x + s, y - s}, {x + s, y + s}, {x - s, y + s}}, colour);
      case Marker::kDiamond:
        return canvas_.area({{x - d, y}, {x, y - d}, {x + d, y}, {x, y + d}}, colour);
      case Marker::kTriangle:
        return canvas_.area({{x, y - 1.1 * t}, {x + t, y + 0.75 * t}, {x - t, y + 0.75 * t}}, colour);
      default:
        return canvas_.disc(p, r, colour);
    }
  }

  void drawSpan(const Span& span) {
    const Point from = layout_.at(span.from, span.y), to = layout_.at(span.to, span.y);
    const double towards = to.x >= from.x ? 1 : -1, head = 16 * u_, gap = (kMarker + 5) * u_;
    const Point start{from.x + towards * gap, from.y}, tip{to.x - towards * 2 * u_, to.y};
    if (towards * (tip.x - start.x) < head) return;
    canvas_.line({start, {tip.x - towards * head, tip.y}}, {kFaintInk, 2.5 * u_});
    canvas_.area(
        {tip, {tip.x - towards * head, tip.y - 0.4 * head}, {tip.x - towards * head, tip.y + 0.4 * head}},
        kFaintInk);
    for (const Point& p : sampled({start, tip}, 8 * u_)) obstacles_.push_back(boxAbout(p, 3 * u_));
    TextStyle style{kName * u_, kInk, true};
    wish(span.label, style, {{0.5 * (start.x + tip.x), start.y}}, 8 * u_);
  }

  void wish(const std::string& text, TextStyle style, std::vector<Point> near, double clearance) {
    near.erase(std::remove_if(near.begin(), near.end(), [&](const Point& p) { return !inFrame(p); }),
               near.end());
    if (text.empty() || near.empty()) return;
    style.halo = true;
    style.y = AlignY::kMiddle;
    texts_.emplace_back(text, style);
    wishes_.push_back(
        {canvas_.textWidth(text, style) + 2 * kPadding * u_, 1.2 * style.size, std::move(near), clearance});
  }

  /// Points before lines, which may be named anywhere along their way.
  void wishLabels() {
    const double clearance = (kMarker + 1.5) * u_;
    for (const bool lines : {false, true})
      for (size_t n = 0; n < chart_.series.size(); ++n) {
        const Series& s = chart_.series[n];
        const Colour colour = darker(colourOf(n));
        if ((s.stroke != Stroke::kNone && s.x.size() > 1) == lines)
          wish(s.name, {kName * u_, colour, true}, lines ? sampled(pointsOf(s), 60 * u_) : pointsOf(s),
               clearance);
        for (size_t i = 0; i < s.labels.size() && !lines; ++i)
          wish(s.labels[i], {kLabel * u_, colour}, {layout_.at(s.x[i], s.y[i])}, clearance);
      }
  }

  void drawLabels() {
    const std::vector<LabelPlace> places = placeLabels(wishes_, obstacles_, frame_);
    for (size_t n = 0; n < places.size(); ++n) {
      const Box& box = places[n].box;
      const Point edge{std::clamp(places[n].near.x, box.left, box.right()),
                       std::clamp(places[n].near.y, box.top, box.bottom())};
      if (places[n].far) canvas_.line({places[n].near, edge}, {kFaintInk.withAlpha(0.7), 1.5 * u_});
      canvas_.text(texts_[n].first, {box.left + kPadding * u_, box.top + 0.5 * box.height}, texts_[n].second);
    }
  }
};

}  // namespace

std::string drawChart(const Chart& chart, PictureFormat format) {
  return Painter(chart, format).draw();
}

}  // namespace vdb_diffuse
