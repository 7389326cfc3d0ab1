#include "sequence/frame_name.h"

#include <cstdio>
#include <regex>

namespace vdb_diffuse {
namespace {

/// Groups: the #s; the digits of %04d; the digit of $F4. What goes on as a word, $FPS, is another variable.
const std::regex& placeholder() {
  static const std::regex expression(R"((#+)|%(?:0?(\d{1,2}))?d|\$F(\d?)(?![A-Za-z0-9_]))");
  return expression;
}

int widthOf(const std::smatch& match) {
  if (match[1].matched) return static_cast<int>(match[1].length());
  for (const int group : {2, 3})
    if (match[group].length() > 0) return std::stoi(match[group]);
  return 1;
}

}  // namespace

bool hasFrame(const std::string& name) {
  return std::regex_search(name, placeholder());
}

std::string frameName(const std::string& name, int frame) {
  std::string result, rest = name;
  for (std::smatch match; std::regex_search(rest, match, placeholder());) {
    char digits[128];
    std::snprintf(digits, sizeof digits, "%0*d", std::min(widthOf(match), 100), frame);
    result += match.prefix().str() + digits;
    rest = match.suffix().str();
  }
  return result + rest;
}

}  // namespace vdb_diffuse
