#pragma once

#include <array>
#include <string>

#include "plot/canvas.h"

namespace vdb_diffuse {

/// Colours for values between two ends, evenly spaced and mixed between.
using ColourMap = std::array<Colour, 5>;

/// Dark to bright, growing in lightness throughout, so that it reads without colours as well.
constexpr ColourMap kLightMap{
    {{0.05, 0.05, 0.12}, {0.25, 0.15, 0.45}, {0.72, 0.25, 0.40}, {0.97, 0.60, 0.25}, {1, 0.98, 0.80}}};
/// Darker, equal, brighter.
constexpr ColourMap kDifferenceMap{
    {{0.10, 0.25, 0.60}, {0.50, 0.65, 0.90}, {0.96, 0.96, 0.96}, {0.93, 0.55, 0.45}, {0.65, 0.08, 0.15}}};

/// \param share   0..1 from one end to the other; beyond an end its colour. What is no number is green
Colour colourOf(const ColourMap& map, double share);

/// A scale: a bar of the colours with words below its left and its right end.
void drawColourBar(Canvas& canvas, const Box& box, const ColourMap& map, const std::string& low,
                   const std::string& high);

}  // namespace vdb_diffuse
