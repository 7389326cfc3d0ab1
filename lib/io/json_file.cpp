#include "io/json_file.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <set>
#include <string_view>
#include <vector>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

constexpr size_t kDeepestJson = 64;
constexpr size_t kMostJsonValues = 20'000'000;  // a number of two bytes becomes sixteen

/// Walks over the brackets and strings of JSON text, well-formed or not, without recursion.
void checkDepthAndKeys(const std::string& text, const std::string& path) {
  std::vector<std::set<std::string_view>> open;  // keys of the objects (and none of the arrays) around
  std::string_view last_string;
  size_t commas = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '"') {
      const size_t begin = i + 1;
      for (++i; i < text.size() && text[i] != '"'; ++i)
        if (text[i] == '\\') ++i;
      last_string =
          std::string_view(text).substr(std::min(begin, text.size()), std::min(i, text.size()) - begin);
    } else if (c == '{' || c == '[') {
      if (open.size() == kDeepestJson)
        throw InputError(path + ": JSON nested deeper than " + std::to_string(kDeepestJson) + " levels");
      open.emplace_back();
    } else if ((c == '}' || c == ']') && !open.empty()) {
      open.pop_back();
    } else if (c == ',' && ++commas > kMostJsonValues) {
      throw InputError(path + ": more than " + std::to_string(kMostJsonValues) + " JSON values");
    } else if (c == ':' && !open.empty() && !open.back().insert(last_string).second) {
      throw InputError(path + ": the key '" + printable(last_string) + "' stands twice in one object");
    }
  }
}

}  // namespace

std::string printable(std::string_view text) {
  std::string line(text.substr(0, 200));
  for (char& c : line)
    if (std::iscntrl(static_cast<unsigned char>(c))) c = ' ';
  return line;
}

size_t regularFileSize(const std::string& path, size_t largest) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) throw InputError(path + ": no such file");
  if (!fs::is_regular_file(status)) throw InputError(path + ": not a regular file");
  const uintmax_t size = fs::file_size(path, error);
  if (error) throw InputError(path + ": cannot be read: " + error.message());
  if (size > largest)
    throw InputError(path + ": " + std::to_string(size) + " bytes, more than the " + std::to_string(largest) +
                     " that are accepted");
  return size;
}

std::string readWholeFile(const std::string& path, size_t largest) {
  const size_t size = regularFileSize(path, largest);
  std::string text(size, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(text.data(), static_cast<std::streamsize>(size));
  if (!file) throw InputError(path + ": cannot be read");
  return text;
}

nlohmann::json parseJson(const std::string& text, const std::string& path) {
  using json = nlohmann::json;
  checkDepthAndKeys(text, path);  // not by the parser's callback, which takes quadratic time
  try {
    return json::parse(text);
  } catch (const json::exception& e) {
    std::string_view what =
        e.what();  // "[json.exception.parse_error.101] parse error at line 1, column 2: ..."
    if (const size_t end = what.find("] "); end != what.npos) what.remove_prefix(end + 2);
    throw InputError(path + ": not valid JSON: " + printable(what));
  }
}

std::string extensionOf(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

}  // namespace vdb_diffuse
