#pragma once

#include <vector>

#include "plot/canvas.h"

namespace vdb_diffuse {

/// Text that wants to stand near one of some points, the first of them best.
struct LabelWish {
  double width = 0, height = 0;
  std::vector<Point> near;
  double clearance = 0;  ///< from the point to the nearest edge of the text
};

struct LabelPlace {
  Box box;
  Point near;        ///< the point it belongs to
  bool far = false;  ///< so far that a line should lead from the point to it
};

/// Places for all labels inside `frame`, such that they keep off each other and off the obstacles as well as
/// a greedy choice can: to the right of the point first, then left, above, below and at the corners, at
/// growing distance. One that finds no free place takes the one where it covers least.
std::vector<LabelPlace> placeLabels(const std::vector<LabelWish>& wishes, const std::vector<Box>& obstacles,
                                    const Box& frame);

}  // namespace vdb_diffuse
