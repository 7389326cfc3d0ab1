#include "report/figure.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace vdb_diffuse {
namespace {

// Of the palette: for Monte Carlo, and for the others in their order.
constexpr int kBlack = 6, kColours[] = {1, 2, 0, 3, 4, 5};

std::string text(const char* format, double value) {
  char out[40];
  std::snprintf(out, sizeof out, format, value);
  return out;
}

/// 1 k, 16 k, 4.2 M: two digits tell enough beside a point.
std::string shortCount(uint64_t n) {
  const double v = static_cast<double>(n);
  const auto [unit, word] = v >= 1e9   ? std::pair<double, const char*>(1e9, " G")
                            : v >= 1e6 ? std::pair<double, const char*>(1e6, " M")
                            : v >= 1e3 ? std::pair<double, const char*>(1e3, " k")
                                       : std::pair<double, const char*>(1, "");
  return text(v / unit < 10 ? "%.2g" : "%.0f", v / unit) + word;
}

bool drawable(const Measurement& row) {
  const double error = row.errors.blocks.rel_rms;
  return row.quantity == "diffuse" && std::isfinite(error) && error > 0 && row.seconds > 0;
}

Series monteCarloSeries(const std::vector<Measurement>& rows) {
  Series series;
  series.name = "Monte Carlo";
  series.marker = Marker::kDisc;
  series.colour = kBlack;
  for (const Measurement& row : rows) {
    if (!drawable(row) || row.samples == 0) continue;
    series.x.push_back(row.seconds);
    series.y.push_back(100 * row.errors.blocks.rel_rms);
    series.labels.push_back(shortCount(row.samples) + (series.labels.empty() ? " paths" : ""));
  }
  return series;
}

/// The deterministic methods, those of one series together.
std::vector<Series> methodSeries(const std::vector<Measurement>& rows) {
  static constexpr Marker kMarkers[] = {Marker::kTriangle, Marker::kSquare, Marker::kDiamond};
  std::vector<Series> all;
  std::vector<std::string> names;
  for (const Measurement& row : rows) {
    if (!drawable(row) || row.samples > 0) continue;
    size_t n = static_cast<size_t>(std::find(names.begin(), names.end(), row.series) - names.begin());
    if (n == names.size()) {
      names.push_back(row.series);
      all.emplace_back();
      all[n].marker = kMarkers[n % 3];
      all[n].colour = kColours[n % 6];
    }
    all[n].x.push_back(row.seconds);
    all[n].y.push_back(100 * row.errors.blocks.rel_rms);
    all[n].labels.push_back(row.label);
  }
  for (Series& series : all)
    if (series.x.size() == 1) {  // a point of its own is named as a line would be
      series.name = series.labels.front();
      series.labels.clear();
    }
  return all;
}

/// The law of Monte Carlo across the time axis, as far as its error lies between the chart's other values.
Series lawSeries(const std::vector<Measurement>& rows, const Chart& chart) {
  Series law;
  law.name = "∝ 1/√t";
  law.stroke = Stroke::kDashed;
  law.colour = kBlack;
  const double c = 100 * lawOf(monteCarloCurve(rows));
  double first = HUGE_VAL, last = 0, least = HUGE_VAL, most = 0;
  for (const Series& series : chart.series)
    for (size_t i = 0; i < series.x.size(); ++i) {
      first = std::min(first, series.x[i]);
      last = std::max(last, series.x[i]);
      least = std::min(least, series.y[i]);
      most = std::max(most, series.y[i]);
    }
  for (const Span& span : chart.spans) last = std::max(last, span.to);
  first = std::max(first, c * c / (most * most));
  last = std::max(last, c * c / (least * least));
  if (!(c > 0 && first < last)) return law;
  law.x = {first, last};
  law.y = {c / std::sqrt(first), c / std::sqrt(last)};
  return law;
}

}  // namespace

Chart figureOf(const std::vector<Measurement>& rows, const FigureWords& words, const std::string& featured) {
  Chart chart;
  chart.title = words.title;
  chart.subtitle = words.subtitle;
  chart.x = {"time (s), without reading and writing", Scale::kLog};
  const std::string width = std::to_string(words.block);
  chart.y = {"error " + (words.block == 1 ? "per voxel" : "on blocks of " + width + "³ voxels") +
                 ", relative RMS (%)",
             Scale::kLog};
  if (words.noise > 0)
    chart.bands.push_back(
        {"noise of the reference, " + text("%.2g", 100 * words.noise) + " %", 0, 100 * words.noise});
  Series monte_carlo = monteCarloSeries(rows);
  for (Series& series : methodSeries(rows)) chart.series.push_back(std::move(series));
  for (const Measurement& row : rows)
    if (drawable(row) && row.method == featured && row.monte_carlo && row.monte_carlo->seconds > row.seconds)
      chart.spans.push_back({text("%.3g", row.monte_carlo->seconds / row.seconds) + " ×", row.seconds,
                             row.monte_carlo->seconds, 100 * row.errors.blocks.rel_rms});
  if (!monte_carlo.x.empty()) {
    chart.series.push_back(std::move(monte_carlo));
    chart.series.insert(chart.series.begin(), lawSeries(rows, chart));
  }
  return chart;
}

}  // namespace vdb_diffuse
