#include "words.h"

#include <algorithm>
#include <cmath>
#include <locale>
#include <sstream>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

void checkRange(const std::string& flag, const std::string& text, double x, double lowest, double highest) {
  if (x < lowest && lowest == 0 && highest == kUnbounded) refuseWord(flag, text, "must not be negative");
  if (x < lowest || x > highest) {
    std::ostringstream range;
    range << "must be from " << lowest << " to " << highest;
    refuseWord(flag, text, range.str());
  }
}

}  // namespace

std::optional<std::vector<double>> numbersIn(const std::string& text) {
  std::vector<double> numbers;
  std::istringstream parts(text + ',');
  for (std::string part; std::getline(parts, part, ',');) {
    std::istringstream in(part);
    in.imbue(std::locale::classic());
    double x;
    if (!(in >> x) || !std::isfinite(x) || !(in >> std::ws).eof()) return std::nullopt;
    numbers.push_back(x);
  }
  return numbers;
}

void refuseWord(const std::string& flag, const std::string& text, const std::string& why) {
  throw UsageError(flag + " " + text + ": " + why);
}

double numberIn(const std::string& flag, const std::string& text, double lowest, double highest) {
  const auto numbers = numbersIn(text);
  if (!numbers || numbers->size() != 1) refuseWord(flag, text, "expected one finite number");
  checkRange(flag, text, numbers->front(), lowest, highest);
  return numbers->front();
}

Vec3d rgbIn(const std::string& flag, const std::string& text, double highest) {
  const auto numbers = numbersIn(text);
  if (!numbers || (numbers->size() != 1 && numbers->size() != 3))
    refuseWord(flag, text, "expected a finite number, or three as r,g,b");
  for (double x : *numbers) checkRange(flag, text, x, 0, highest);
  return numbers->size() == 1 ? Vec3d(numbers->front()) : Vec3d(numbers->data());
}

Vec3d pointIn(const std::string& flag, const std::string& text) {
  const auto numbers = numbersIn(text);
  if (!numbers || numbers->size() != 3) refuseWord(flag, text, "expected three finite numbers, X,Y,Z");
  return Vec3d(numbers->data());
}

WorldBox boxIn(const std::string& flag, const std::string& text) {
  const auto x = numbersIn(text);
  if (!x || x->size() != 6) refuseWord(flag, text, "expected six finite numbers, x0,y0,z0,x1,y1,z1");
  const WorldBox box{Vec3d((*x)[0], (*x)[1], (*x)[2]), Vec3d((*x)[3], (*x)[4], (*x)[5])};
  for (int a = 0; a < 3; ++a)
    if (box.low[a] > box.high[a]) refuseWord(flag, text, "the low corner comes first");
  return box;
}

Vec3d directionIn(const std::string& flag, const std::string& text) {
  const Vec3d v = pointIn(flag, text);
  const double scale = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
  if (scale == 0) refuseWord(flag, text, "a direction cannot be zero");
  return (v / scale).unit();  // first to about 1, as a square may underflow or overflow
}

}  // namespace vdb_diffuse
