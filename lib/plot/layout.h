#pragma once

#include "plot/chart.h"

namespace vdb_diffuse {

/// The ends of an axis.
struct Range {
  double low = 0, high = 1;
};

/// Where a chart's numbers come to lie on the sheet:
///
///     +--------------------------+
///     | title                    |
///     |    +-----------------+   |
///     |  y |     frame       |   |
///     |    +-----------------+   |
///     |            x             |
///     +--------------------------+
struct Layout {
  double unit = 1;  ///< pixels in a thousandth of the usual sheet's height: letters are 22 to 34 of it
  Box frame;        ///< what the axes enclose; beyond it, points are cut off
  Range x, y;
  Scale scale_x = Scale::kLinear, scale_y = Scale::kLinear;

  Point at(double x_value, double y_value) const;
};

/// \throws InputError as drawChart
Layout layOut(const Chart& chart);

}  // namespace vdb_diffuse
