#include "plot/layout.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

constexpr double kMargin = 0.06;  // of an axis, beyond the data at either end

[[noreturn]] void refuse(const Chart& chart, const std::string& what) {
  throw InputError("chart '" + chart.title + "': " + what);
}

void checkValue(const Chart& chart, const Axis& axis, const std::string& owner, double value) {
  std::ostringstream text;
  text << owner << ": " << value;
  if (!std::isfinite(value)) refuse(chart, text.str() + " is no number that can be drawn");
  if (axis.scale == Scale::kLog && !(value > 0))
    refuse(chart, text.str() + " does not lie on a logarithmic axis");
}

void checkSeries(const Chart& chart, const Series& s) {
  const std::string owner = "series '" + s.name + "'";
  if (s.x.size() != s.y.size() || (!s.y_error.empty() && s.y_error.size() != s.y.size()) ||
      (!s.labels.empty() && s.labels.size() != s.x.size()))
    refuse(chart, owner + ": has lists of different lengths");
  for (const double x : s.x) checkValue(chart, chart.x, owner, x);
  for (const double y : s.y) checkValue(chart, chart.y, owner, y);
  for (const double e : s.y_error)
    if (!std::isfinite(e) || e < 0) refuse(chart, owner + ": has an error that is no size");
}

/// From the axis' own ends, where it has them, and from the values, with a margin.
Range rangeOf(const Chart& chart, const Axis& axis, const std::vector<double>& values) {
  const bool log = axis.scale == Scale::kLog;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (double v : values) {
    if (log && !(v > 0)) continue;  // the lower end of an error bar or of a band
    v = log ? std::log10(v) : v;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  if (!(low <= high)) low = high = 0;
  if (high - low <= 1e-12 * std::max(std::abs(low), std::abs(high))) {
    const double around = log ? 0.3 : low == 0 ? 1 : 0.1 * std::abs(low);
    low -= around;
    high += around;
  }
  const double margin = kMargin * (high - low);
  Range range{low - margin, high + margin};
  if (log) range = {std::pow(10.0, range.low), std::pow(10.0, range.high)};
  if (axis.low) range.low = *axis.low;
  if (axis.high) range.high = *axis.high;
  for (const double end : {range.low, range.high}) checkValue(chart, axis, "axis '" + axis.label + "'", end);
  if (!(range.low < range.high)) refuse(chart, "axis '" + axis.label + "' ends where it begins, or before");
  return range;
}

double fraction(Scale scale, const Range& range, double v) {
  if (scale == Scale::kLinear) return (v - range.low) / (range.high - range.low);
  return std::log(v / range.low) / std::log(range.high / range.low);
}

}  // namespace

Point Layout::at(double x_value, double y_value) const {
  return {frame.left + frame.width * fraction(scale_x, x, x_value),
          frame.bottom() - frame.height * fraction(scale_y, y, y_value)};
}

Layout layOut(const Chart& chart) {
  constexpr int kMost = 30000;  // cairo draws no larger picture
  if (chart.width < 100 || chart.height < 100 || chart.width > kMost || chart.height > kMost)
    refuse(chart, "a sheet has 100 to 30000 pixels each way");
  std::vector<double> x, y;
  for (const Series& s : chart.series) {
    checkSeries(chart, s);
    x.insert(x.end(), s.x.begin(), s.x.end());
    for (size_t i = 0; i < s.y.size(); ++i) {
      const double e = s.y_error.empty() ? 0 : s.y_error[i];
      y.insert(y.end(), {s.y[i], s.y[i] - e, s.y[i] + e});
    }
  }
  for (const Band& band : chart.bands) y.insert(y.end(), {band.low, band.high});
  for (const Span& span : chart.spans) {
    checkValue(chart, chart.y, span.label, span.y);
    for (const double end : {span.from, span.to}) checkValue(chart, chart.x, span.label, end);
    x.insert(x.end(), {span.from, span.to});
    y.push_back(span.y);
  }

  Layout layout;
  const double u = layout.unit = std::min(chart.width / 1600.0, chart.height / 1000.0);
  const double top = (chart.title.empty() ? 40 : 92) + (chart.subtitle.empty() ? 0 : 40);
  layout.frame = {150 * u, top * u, chart.width - 200 * u, chart.height - (top + 112) * u};
  layout.scale_x = chart.x.scale;
  layout.scale_y = chart.y.scale;
  layout.x = rangeOf(chart, chart.x, x);
  layout.y = rangeOf(chart, chart.y, y);
  return layout;
}

}  // namespace vdb_diffuse
