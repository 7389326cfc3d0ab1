#include "plot/panels.h"

#include <algorithm>
#include <cmath>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

constexpr double kMargin = 28, kGap = 20, kTitle = 26, kSubtitle = 17, kSmall = 15;
constexpr Colour kInk{0.13, 0.13, 0.13}, kFaintInk{0.38, 0.38, 0.38};

class Sheet {
 public:
  explicit Sheet(const PanelSheet& sheet) : s_(sheet) {
    check();
    top_ = 44 + (s_.subtitle.empty() ? 0 : 28) + 8;
    left_ = kMargin + (s_.row_names.empty() ? 0 : 30) + (named(&Panel::rows) ? 62 : 0) +
            (s_.y_label.empty() ? 0 : 26);
    name_ = 26;
    below_ = named(&Panel::columns) ? 26 : 0;
  }

  std::string draw(PictureFormat format) {
    double width = 0, y = top_;
    std::vector<double> tops;
    for (const auto& row : s_.rows) {
      double x = left_, high = 0;
      for (const Panel& p : row) {
        x += p.width * s_.cell_width + kGap;
        high = std::max(high, p.height * s_.cell_height);
      }
      width = std::max(width, x - kGap);
      tops.push_back(y + name_);
      y += name_ + high + below_ + 12;
    }
    if (!s_.x_label.empty()) y += 26;
    const double bar = y + 12, height = hasScale() ? bar + 62 : y + 8;
    // Words may be wider than few panels.
    Canvas measure(format, 100, 100);
    const double words = kMargin + std::max(measure.textWidth(s_.title, {kTitle, kInk, true}),
                                            measure.textWidth(s_.subtitle, {kSubtitle, kFaintInk}));
    const int wide = static_cast<int>(std::ceil(std::max(width, words) + kMargin));
    Canvas canvas(format, wide, static_cast<int>(std::ceil(height)));
    canvas.text(s_.title, {kMargin, 44}, {kTitle, kInk, true});
    canvas.text(s_.subtitle, {kMargin, 44 + 28}, {kSubtitle, kFaintInk});
    for (size_t n = 0; n < s_.rows.size(); ++n) {
      double x = left_;
      for (size_t k = 0; k < s_.rows[n].size(); ++k) {
        drawPanel(canvas, s_.rows[n][k], {x, tops[n]}, k == 0, n + 1 == s_.rows.size());
        x += s_.rows[n][k].width * s_.cell_width + kGap;
      }
      if (!s_.row_names.empty()) {
        TextStyle style{kSubtitle, kInk, true, AlignX::kMiddle, AlignY::kMiddle, true};
        const double high = s_.rows[n].empty() ? 0 : s_.rows[n][0].height * s_.cell_height;
        canvas.text(s_.row_names[n], {kMargin + 6, tops[n] + high / 2}, style);
      }
    }
    if (hasScale()) drawScale(canvas, {left_, bar, std::min(width - left_, 640.0), 16});
    return canvas.finish();
  }

 private:
  const PanelSheet& s_;
  double top_, left_, name_, below_;

  bool named(const std::vector<std::string> Panel::*names) const {
    for (const auto& row : s_.rows)
      for (const Panel& p : row)
        if (!(p.*names).empty()) return true;
    return false;
  }

  void check() const {
    const auto fits = [](size_t length, size_t wanted) { return length == 0 || length == wanted; };
    bool good = fits(s_.row_names.size(), s_.rows.size());
    for (const auto& row : s_.rows)
      for (const Panel& p : row)
        good = good &&
               (p.colours.empty() ? p.values.size() : p.colours.size()) ==
                   static_cast<size_t>(p.width) * p.height &&
               fits(p.words.size(), static_cast<size_t>(p.width) * p.height) &&
               fits(p.columns.size(), p.width) && fits(p.rows.size(), p.height);
    if (!good) throw InputError("sheet '" + s_.title + "': has lists of the wrong lengths");
  }

  double shareOf(double value) const { return (value - s_.low) / (s_.high - s_.low); }

  /// In steps too small to see, of which a file of half the size is made.
  Colour stepped(double share) const {
    constexpr double kSteps = 72;
    return colourOf(s_.map, std::round(kSteps * share) / kSteps);
  }

  /// Names along the axes stand at the outer panels alone.
  void drawPanel(Canvas& canvas, const Panel& p, const Point& at, bool leftmost, bool lowest) const {
    const double x = at.x, y = at.y;
    const double w = s_.cell_width, h = s_.cell_height;
    canvas.text(p.title, {x, y - 8}, {kSubtitle, kInk});
    std::vector<Colour> pixels = p.colours;
    if (pixels.empty())
      for (const double v : p.values) pixels.push_back(stepped(shareOf(v)));
    canvas.pixels({x, y, p.width * w, p.height * h}, p.width, p.height, pixels);
    for (size_t n = 0; n < p.words.size(); ++n) {
      const Colour& c = pixels[n];
      const bool dark = 0.3 * c.red + 0.6 * c.green + 0.1 * c.blue < 0.5;
      TextStyle style{kSmall, dark ? Colour{1, 1, 1} : kInk, false, AlignX::kMiddle, AlignY::kMiddle};
      canvas.text(p.words[n], {x + (n % p.width + 0.5) * w, y + (n / p.width + 0.5) * h}, style);
    }
    for (const double mark : p.marks)
      canvas.line({{x + mark * w, y - 4}, {x + mark * w, y + p.height * h + 4}}, {{0, 0.62, 0.45}, 3, true});
    TextStyle middle{kSmall, kInk, false, AlignX::kMiddle};
    for (size_t n = 0; n < p.columns.size(); ++n)
      canvas.text(p.columns[n], {x + (n + 0.5) * w, y + p.height * h + 19}, middle);
    if (lowest)
      canvas.text(s_.x_label, {x + p.width * w / 2, y + p.height * h + (p.columns.empty() ? 19 : 42)},
                  middle);
    if (!leftmost) return;
    TextStyle right{kSmall, kInk, false, AlignX::kRight, AlignY::kMiddle};
    for (size_t n = 0; n < p.rows.size(); ++n) canvas.text(p.rows[n], {x - 8, y + (n + 0.5) * h}, right);
    TextStyle upwards{kSmall, kInk, false, AlignX::kMiddle, AlignY::kMiddle, true};
    canvas.text(s_.y_label, {x - (p.rows.empty() ? 16 : 74), y + p.height * h / 2}, upwards);
  }

  bool hasScale() const { return !(s_.low_label + s_.scale_label + s_.high_label).empty(); }

  void drawScale(Canvas& canvas, const Box& box) const {
    constexpr int kSteps = 256;
    std::vector<Colour> pixels;
    for (int n = 0; n < kSteps; ++n) pixels.push_back(colourOf(s_.map, (n + 0.5) / kSteps));
    canvas.pixels(box, kSteps, 1, pixels);
    TextStyle style{kSmall, kInk};
    canvas.text(s_.low_label, {box.left, box.bottom() + 20}, style);
    style.x = AlignX::kMiddle;
    canvas.text(s_.scale_label, {box.left + box.width / 2, box.bottom() + 20}, style);
    style.x = AlignX::kRight;
    canvas.text(s_.high_label, {box.right(), box.bottom() + 20}, style);
  }
};

}  // namespace

std::string drawPanels(const PanelSheet& sheet, PictureFormat format) {
  return Sheet(sheet).draw(format);
}

}  // namespace vdb_diffuse
