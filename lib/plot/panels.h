#pragma once

#include <string>
#include <vector>

#include "plot/colour_map.h"

namespace vdb_diffuse {

/// One picture of a sheet: a rectangle of values, each a small square or one with words in it.
struct Panel {
  std::string title;
  int width = 0, height = 0;         ///< values
  std::vector<double> values{};      ///< row after row from the top; shown from `low` to `high` of the sheet
  std::vector<Colour> colours{};     ///< in the place of those of the values{}; empty: by the values
  std::vector<std::string> words{};  ///< in each value's square; empty: none
  std::vector<std::string> columns{}, rows{};  ///< names of the values' columns and rows; empty: none
  std::vector<double> marks{};                 ///< vertical lines, in columns from the left
};

/// Panels in rows under a title, with one scale of colours for all:
///
///      title
///      subtitle
///      row name   +-------+  +-------+  +-------+
///                 |       |  |       |  |       |
///                 +-------+  +-------+  +-------+
///      [============ scale ============]
struct PanelSheet {
  std::string title, subtitle;
  std::vector<std::vector<Panel>> rows;
  std::vector<std::string> row_names;  ///< to the left, upwards; empty: none
  ColourMap map = kLightMap;
  double low = 0, high = 1;
  std::string scale_label;                 ///< "I_d0 over its largest"; no labels at all: no scale
  std::string low_label, high_label;       ///< at the ends of the scale
  std::string x_label, y_label;            ///< of the values' columns and rows
  double cell_width = 1, cell_height = 1;  ///< of a value, pixels
};

/// \throws InputError for lists of the wrong lengths
std::string drawPanels(const PanelSheet& sheet, PictureFormat format);

}  // namespace vdb_diffuse
