#include "plot/label_places.h"

#include <algorithm>
#include <limits>

namespace vdb_diffuse {
namespace {

constexpr double kFarther[] = {1, 1.5, 2.2, 3, 4, 6.5, 9.5, 13, 18, 25};  // distances tried, of the clearance
constexpr double kNear = 3;  // up to here nobody wonders where a label belongs
// Costs, where a place farther off costs its distance: more than any distance for touching something, and
// this more for lying on it whole.
constexpr double kTouching = 25, kCovered = 30;
constexpr double kNextPoint = 0.7, kNextSide = 0.12;

double overlap(const Box& a, const Box& b) {
  const double width = std::min(a.right(), b.right()) - std::max(a.left, b.left);
  const double height = std::min(a.bottom(), b.bottom()) - std::max(a.top, b.top);
  return width > 0 && height > 0 ? width * height : 0;
}

/// A box to one side of p: (x, y) is (1, 0) for right, (-1, -1) for above and left.
Box beside(const Point& p, int x, int y, double width, double height, double distance) {
  const double diagonal = x != 0 && y != 0 ? 0.7 : 1;
  Box box{p.x - width / 2, p.y - height / 2, width, height};
  if (x != 0) box.left = x > 0 ? p.x + diagonal * distance : p.x - diagonal * distance - width;
  if (y != 0) box.top = y > 0 ? p.y + diagonal * distance : p.y - diagonal * distance - height;
  return box;
}

LabelPlace bestPlace(const LabelWish& wish, const std::vector<Box>& taken, const Box& frame) {
  static constexpr int kSides[][2] = {{1, 0}, {1, -1}, {1, 1}, {-1, 0}, {0, -1}, {0, 1}, {-1, -1}, {-1, 1}};
  LabelPlace best;
  double least = std::numeric_limits<double>::infinity();
  for (size_t n = 0; n < wish.near.size(); ++n)
    for (const double farther : kFarther)
      for (size_t side = 0; side < 8; ++side) {
        const Box box = beside(wish.near[n], kSides[side][0], kSides[side][1], wish.width, wish.height,
                               farther * wish.clearance);
        const double preference = kNextPoint * n + (farther - 1) + kNextSide * side;
        if (preference >= least) continue;
        double covered = frame.holds(box) ? 0 : 3 * (wish.width * wish.height - overlap(box, frame));
        bool touches = covered > 0;
        for (const Box& other : taken) {
          const double area = overlap(box, other);
          covered += area;
          touches = touches || area > 0;
        }
        const double cost =
            preference + (touches ? kTouching + kCovered * covered / (wish.width * wish.height) : 0);
        if (cost >= least) continue;
        least = cost;
        best = {box, wish.near[n], farther > kNear};
      }
  return best;
}

}  // namespace

std::vector<LabelPlace> placeLabels(const std::vector<LabelWish>& wishes, const std::vector<Box>& obstacles,
                                    const Box& frame) {
  std::vector<Box> taken = obstacles;
  std::vector<LabelPlace> places;
  for (const LabelWish& wish : wishes) {
    places.push_back(bestPlace(wish, taken, frame));
    taken.push_back(places.back().box);
  }
  return places;
}

}  // namespace vdb_diffuse
