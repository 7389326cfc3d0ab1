#pragma once

#include <optional>
#include <string>
#include <vector>

#include "plot/canvas.h"
#include "plot/ticks.h"

namespace vdb_diffuse {

struct Axis {
  std::string label;  ///< with its unit: "time (s)"
  Scale scale = Scale::kLinear;
  std::optional<double> low{}, high{};  ///< unset: from the data, with a margin
};

enum class Marker { kNone, kDisc, kSquare, kDiamond, kTriangle, kRing };
enum class Stroke { kNone, kSolid, kDashed };

/// Points in the plane, joined by lines or not.
struct Series {
  std::string name;  ///< written beside it; empty: unnamed
  std::vector<double> x, y;
  std::vector<double> y_error;      ///< half the length of the error bars; empty: none
  bool error_band = false;          ///< the errors as a shaded band along the line, not as bars
  std::vector<std::string> labels;  ///< of single points; empty: none
  Marker marker = Marker::kNone;
  Stroke stroke = Stroke::kSolid;
  int colour = -1;  ///< of the palette; -1: the next one
};

/// A shaded strip across the chart; what lies beyond the axis is cut off.
struct Band {
  std::string label;
  double low = 0, high = 0;  ///< in y
};

/// A distance in x that is worth a word: an arrow from one point to another at the same height.
struct Span {
  std::string label;
  double from = 0, to = 0, y = 0;
};

/// What to show. Names and labels stand beside what they name, in its colour, and keep off each other.
struct Chart {
  std::string title, subtitle;
  Axis x, y;
  std::vector<Series> series;
  std::vector<Band> bands;
  std::vector<Span> spans;
  int width = 1600, height = 1000;  ///< pixels; letters and lines grow with the sheet
};

/// The chart as a file's bytes. Colours can be told apart by the colour-blind (Okabe and Ito 2008).
/// \throws InputError for lists of different lengths, values that are not finite, a range that is none, and
///         zero or negative values on a logarithmic axis
std::string drawChart(const Chart& chart, PictureFormat format);

}  // namespace vdb_diffuse
