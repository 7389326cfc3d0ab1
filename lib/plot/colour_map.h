#pragma once

#include <array>

#include "plot/canvas.h"

namespace vdb_diffuse {

/// Five colours at even distances, straight lines between them.
using ColourMap = std::array<Colour, 5>;

/// Dark to bright, growing in lightness throughout, so that it reads without colours as well.
constexpr ColourMap kLightMap{
    {{0.05, 0.05, 0.12}, {0.25, 0.15, 0.45}, {0.72, 0.25, 0.40}, {0.97, 0.60, 0.25}, {1, 0.98, 0.80}}};
/// Darker, equal, brighter.
constexpr ColourMap kDifferenceMap{
    {{0.10, 0.25, 0.60}, {0.50, 0.65, 0.90}, {0.96, 0.96, 0.96}, {0.93, 0.55, 0.45}, {0.65, 0.08, 0.15}}};

/// \param share  0 to 1, held to it; one that is not finite is green, which no map has
Colour colourOf(const ColourMap& map, double share);

}  // namespace vdb_diffuse
