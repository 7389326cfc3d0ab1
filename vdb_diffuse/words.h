#pragma once

#include <CLI/CLI.hpp>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "grid/volume_cut.h"

namespace vdb_diffuse {

/// Flags whose values are kept as they were typed and understood later, so that every fault is one line that
/// names flag and value. Numbers are finite and written with a point, whatever the locale.

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

/// "a,b,c" as numbers; nothing where any part is not one.
std::optional<std::vector<double>> numbersIn(const std::string& text);

/// These throw UsageError.
[[noreturn]] void refuseWord(const std::string& flag, const std::string& text, const std::string& why);
double numberIn(const std::string& flag, const std::string& text, double lowest = -kUnbounded,
                double highest = kUnbounded);
/// r,g,b or one number for grey; each from 0 to `highest`.
Vec3d rgbIn(const std::string& flag, const std::string& text, double highest = kUnbounded);
Vec3d pointIn(const std::string& flag, const std::string& text);
/// x0,y0,z0,x1,y1,z1, the low corner first.
WorldBox boxIn(const std::string& flag, const std::string& text);
/// Of length 1.
Vec3d directionIn(const std::string& flag, const std::string& text);

/// Adds an option of a group; `Value` is a string, an optional one or a list.
template <typename Value>
CLI::Option* addWord(CLI::App& app, const std::string& group, const std::string& flag, Value& value,
                     const std::string& type, const std::string& help) {
  return app.add_option(flag, value, help)->type_name(type)->group(group);
}

}  // namespace vdb_diffuse
