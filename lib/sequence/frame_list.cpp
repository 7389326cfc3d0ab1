#include "sequence/frame_list.h"

#include <cstdlib>
#include <regex>
#include <sstream>
#include <unordered_set>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

constexpr size_t kMostFrames = 1'000'000;  // half a day of film

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw UsageError("--frames " + text + ": " + why);
}

}  // namespace

std::vector<int> framesIn(const std::string& text) {
  static const std::regex kPart(R"((-?\d{1,8})(?:-(-?\d{1,8})(?:[x:](\d{1,8}))?)?)");
  std::vector<int> frames;
  std::unordered_set<int> listed;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    std::smatch match;
    if (!std::regex_match(part, match, kPart))
      refuse(text, "'" + part + "' is none of 5, 1-100, 1-100x2 and 1-100:2");
    const int first = std::stoi(match[1]), last = match[2].matched ? std::stoi(match[2]) : first;
    const int step = match[3].matched ? std::stoi(match[3]) : 1;
    if (step == 0) refuse(text, "a step of 0 never ends");
    for (int n = 0; n <= std::abs(last - first) / step; ++n) {
      const int frame = first + (last < first ? -n : n) * step;
      if (listed.insert(frame).second) frames.push_back(frame);
      if (frames.size() > kMostFrames) refuse(text, "more than " + std::to_string(kMostFrames) + " frames");
    }
  }
  if (frames.empty() || text.back() == ',') refuse(text, "a number is missing");
  return frames;
}

}  // namespace vdb_diffuse
