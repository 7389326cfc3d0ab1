#include "io/json_place.h"

#include <algorithm>
#include <filesystem>

#include "grid/error.h"
#include "grid/spelling.h"
#include "io/json_file.h"

namespace vdb_diffuse {

using nlohmann::json;

std::string didYouMean(const std::string& word, const std::vector<std::string>& known) {
  const std::string nearest = nearestSpelling(word, known);
  if (!nearest.empty()) return ", did you mean '" + nearest + "'?";
  std::string list = "; known:";
  for (const std::string& k : known) list += ' ' + k;
  return list;
}

void JsonPlace::refuse(const std::string& what) const {
  throw InputError(file + ": " + (at.empty() ? "" : at + ": ") + what);
}

void JsonPlace::refuseType(const std::string& expected) const {
  std::string found = value.dump(-1, ' ', true, json::error_handler_t::replace);
  if (found.size() > 40) found = found.substr(0, 37) + "...";
  refuse("expected " + expected + ", found " + found);
}

void JsonPlace::onlyKeys(const std::vector<std::string>& known) const {
  if (!value.is_object()) refuseType("an object { }");
  for (const auto& item : value.items())
    if (std::find(known.begin(), known.end(), item.key()) == known.end())
      refuse("unknown key '" + printable(item.key()) + "'" + didYouMean(item.key(), known));
}

void JsonPlace::needs(std::initializer_list<const char*> keys) const {
  for (const char* key : keys)
    if (!has(key)) refuse("needs '" + std::string(key) + "'");
}

std::string JsonPlace::text() const {
  if (!value.is_string()) refuseType("a text");
  if (value.get_ref<const std::string&>().find('\0') != std::string::npos)
    refuse("a text without NUL characters is expected");  // which file names and grid names end at
  return value.get<std::string>();
}

double JsonPlace::number(double lowest, double highest) const {
  if (!value.is_number()) refuseType("a number");
  const double x = value.get<double>();
  if (!std::isfinite(x)) refuse("not finite");
  if (x < lowest || x > highest) {
    const auto shown = [](double v) { return json(v).dump(); };
    refuse(shown(x) + (highest == HUGE_VAL ? " is less than " + shown(lowest)
                                           : " is not from " + shown(lowest) + " to " + shown(highest)));
  }
  return x;
}

int JsonPlace::integer(int lowest, int highest) const {
  const double x = number(lowest, highest);
  if (x != std::floor(x)) refuseType("a whole number");
  return static_cast<int>(x);
}

Vec3d JsonPlace::vector() const {
  if (!value.is_array() || value.size() != 3) refuseType("three numbers [x, y, z]");
  return Vec3d((*this)[size_t(0)].number(), (*this)[size_t(1)].number(), (*this)[size_t(2)].number());
}

Vec3d JsonPlace::direction() const {
  const Vec3d v = vector();
  const double scale = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
  if (scale == 0) refuse("a direction cannot be zero");
  return (v / scale).unit();  // first to about 1, as a square may underflow or overflow
}

Vec3d JsonPlace::rgb(double highest) const {
  if (value.is_number()) return Vec3d(number(0, highest));
  if (!value.is_array() || value.size() != 3) refuseType("a number or three [r, g, b]");
  return Vec3d((*this)[size_t(0)].number(0, highest), (*this)[size_t(1)].number(0, highest),
               (*this)[size_t(2)].number(0, highest));
}

std::string JsonPlace::pathIn(const char* key) const {
  return (std::filesystem::path(file).parent_path() / (*this)[key].text()).string();
}

}  // namespace vdb_diffuse
