#pragma once

#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "grid/transform.h"

namespace vdb_diffuse {

/// A value inside a JSON file that a user wrote, and that knows where it stands, so that every fault is told
/// as "scene.json: lights[2].angle: ...". All functions throw InputError.
struct JsonPlace {
  const nlohmann::json& value;
  const std::string& file;
  std::string at;  ///< "lights[2].angle"; empty: the file's outermost value

  [[noreturn]] void refuse(const std::string& what) const;
  [[noreturn]] void refuseType(const std::string& expected) const;

  bool has(const char* key) const { return value.contains(key); }
  JsonPlace operator[](const std::string& key) const {
    return {value[key], file, at.empty() ? key : at + "." + key};
  }
  JsonPlace operator[](size_t i) const { return {value[i], file, at + "[" + std::to_string(i) + "]"}; }

  /// An object with no other keys than these: an unknown key is named, with the nearest that is known.
  void onlyKeys(const std::vector<std::string>& known) const;
  void needs(std::initializer_list<const char*> keys) const;

  std::string text() const;
  double number(double lowest = -HUGE_VAL, double highest = HUGE_VAL) const;
  int integer(int lowest, int highest) const;
  Vec3d vector() const;
  /// Of length 1.
  Vec3d direction() const;
  /// A number for grey, or three; each from 0 to `highest`.
  Vec3d rgb(double highest = HUGE_VAL) const;
  Vec3d rgbOr(const char* key, double fallback, double highest = HUGE_VAL) const {
    return has(key) ? (*this)[key].rgb(highest) : Vec3d(fallback);
  }
  double numberOr(const char* key, double fallback, double lowest, double highest) const {
    return has(key) ? (*this)[key].number(lowest, highest) : fallback;
  }
  /// A path relative to the file's folder.
  std::string pathIn(const char* key) const;
  std::string textOr(const char* key, const std::string& usual) const {
    return has(key) ? (*this)[key].text() : usual;
  }
};

/// ", did you mean 'x'?", or all that is known where nothing is near.
std::string didYouMean(const std::string& word, const std::vector<std::string>& known);

}  // namespace vdb_diffuse
