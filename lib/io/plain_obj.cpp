#include "io/plain_obj.h"

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include "grid/error.h"
#include "io/gltf_json.h"
#include "io/json_file.h"
#include "io/mesh_file.h"

namespace vdb_diffuse {
namespace {

/// The time that cutting a polygon into triangles takes grows with the square of its corners, or worse.
constexpr size_t kMostCorners = 1000;
constexpr size_t kLongestNumber = 60;
constexpr size_t kMostSquares = 100'000'000;  ///< of the corners of faces with more than four, together

class PlainObj {
 public:
  PlainObj(const std::string& text, const std::string& path) : text_(text), path_(path) {
    plain_.reserve(text.size() + 1);
  }

  std::string made() {
    std::string joined;
    for (size_t at = 0; at < text_.size();) {
      const size_t end = std::min(text_.find('\n', at), text_.size());
      std::string_view line(text_.data() + at, end - at);
      at = end + 1;
      ++line_;
      if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
      const bool goes_on = !line.empty() && line.back() == '\\';
      if (goes_on) line.remove_suffix(1);
      if (goes_on || !joined.empty()) {
        joined += line;
        joined += ' ';
        if (goes_on) continue;
        line = joined;
      }
      take(line);
      joined.clear();
    }
    if (farthest_ > vertices_) {
      line_ = farthest_line_;
      refuse("there is no vertex " + std::to_string(farthest_) + " among " + std::to_string(vertices_));
    }
    return std::move(plain_);
  }

 private:
  const std::string& text_;
  const std::string& path_;
  std::string plain_;
  size_t line_ = 0, vertices_ = 0, faces_ = 0, squares_ = 0;
  size_t farthest_ = 0, farthest_line_ = 0;  ///< vertex that a face names, and where

  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError(path_ + ": line " + std::to_string(line_) + ": " + what);
  }

  static std::string_view word(std::string_view& line) {
    const size_t from = line.find_first_not_of(" \t");
    if (from == std::string_view::npos) return {};
    const size_t end = std::min(line.find_first_of(" \t", from), line.size());
    const std::string_view found = line.substr(from, end - from);
    line.remove_prefix(end);
    return found;
  }

  void take(std::string_view line) {
    line = line.substr(0, line.find('#'));
    const std::string_view kind = word(line);
    if (kind == "v") return vertex(line);
    if (kind == "f") return face(line);
  }

  /// Three numbers, or four where the last divides the others; colours follow the three.
  void vertex(std::string_view line) {
    std::string numbers[5];
    int count = 0;
    for (; count < 5; ++count) {
      numbers[count] = word(line);
      if (numbers[count].empty()) break;
      char* end = nullptr;
      std::strtod(numbers[count].c_str(), &end);
      if (*end != 0 || numbers[count].size() > kLongestNumber) refuse("a vertex is three numbers");
    }
    if (count < 3) refuse("a vertex is three numbers");
    plain_ += 'v';
    for (int n = 0; n < (count == 4 ? 4 : 3); ++n) plain_ += ' ' + numbers[n];
    plain_ += '\n';
    ++vertices_;
  }

  /// Counted from the first vertex, 1; what counts back from the last is counted anew.
  void face(std::string_view line) {
    const size_t start = plain_.size();
    plain_ += 'f';
    size_t corners = 0;
    for (std::string_view corner = word(line); !corner.empty(); corner = word(line)) {
      const std::string number(corner.substr(0, std::min(corner.find('/'), size_t{20})));
      char* end = nullptr;
      const long long index = std::strtoll(number.c_str(), &end, 10),
                      vertex = index < 0 ? static_cast<long long>(vertices_) + 1 + index : index;
      if (number.empty() || *end != 0 || vertex < 1) refuse("there is no vertex '" + printable(number) + "'");
      if (static_cast<size_t>(vertex) > farthest_) {
        farthest_ = static_cast<size_t>(vertex);
        farthest_line_ = line_;
      }
      if (++corners <= kMostCorners) plain_ += ' ' + std::to_string(vertex);
    }
    if (corners > kMostCorners)
      refuse("a face with " + std::to_string(corners) + " corners, more than the " +
             std::to_string(kMostCorners) + " that are accepted; cut it into triangles");
    if (corners > 4 && (squares_ += corners * corners) > kMostSquares)
      refuse("too many faces of many corners; cut them into triangles");
    plain_ += '\n';
    if (corners < 3) plain_.resize(start);  // a point or a line
    if (corners >= 3 && ++faces_ > kMostTriangles)
      refuse("more than " + std::to_string(kMostTriangles) + " faces");
  }
};

}  // namespace

std::string plainObj(const std::string& path) {
  return PlainObj(readWholeFile(path, kLargestMeshFile), path).made();
}

}  // namespace vdb_diffuse
