#include "check/cases_file.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "io/json_file.h"
#include "io/json_place.h"

namespace vdb_diffuse {
namespace {

constexpr size_t kLargestFile = 16 << 20;  // bytes
constexpr int kLargestBlock = 1 << 10;

const std::vector<std::string> kSharedKeys{"bake", "grids", "max_rms", "max_abs", "block"};

/// "$SHOW/cloud.vdb" with the variable's value, then relative to the file's folder.
std::string volumePath(const JsonPlace& place) {
  std::string path = place.text();
  if (path[0] == '$') {
    const size_t end = std::min(path.find('/'), path.size());
    const std::string variable = path.substr(1, end - 1);
    const char* value = std::getenv(variable.c_str());
    if (!value) place.refuse("the environment variable '" + printable(variable) + "' is not set");
    path = value + path.substr(end);
  }
  return (std::filesystem::path(place.file).parent_path() / path).string();
}

std::vector<std::string> namesIn(const JsonPlace& list) {
  if (!list.value.is_array() || list.value.empty()) list.refuseType("a list of names [ ]");
  std::vector<std::string> names;
  for (size_t i = 0; i < list.value.size(); ++i) {
    names.push_back(list[i].text());
    const std::vector<std::string> known{"diffuse", "direct", "flux", "source"};
    if (std::find(known.begin(), known.end(), names.back()) == known.end())
      list[i].refuse("no bake makes a grid '" + printable(names.back()) + "'" +
                     didYouMean(names.back(), known));
  }
  return names;
}

void readShared(const JsonPlace& place, CheckCase& c) {
  if (place.has("bake")) c.bake = place["bake"].text();
  if (place.has("grids")) c.grids = namesIn(place["grids"]);
  if (place.has("max_rms")) c.max_rms = place["max_rms"].number(0);
  if (place.has("max_abs")) c.max_abs = place["max_abs"].number(0);
  if (place.has("block")) c.block = place["block"].integer(1, kLargestBlock);
}

/// A name becomes part of file names.
std::string caseName(const JsonPlace& place) {
  const std::string name = place.text();
  const bool fit = !name.empty() && name.size() <= 100 && name[0] != '.' &&
                   std::all_of(name.begin(), name.end(), [](unsigned char c) {
                     return c < 128 && (std::isalnum(c) || c == '_' || c == '-' || c == '.');
                   });
  if (!fit) place.refuse("a name is made of at most 100 letters, digits and . _ -, and begins with no dot");
  return name;
}

CheckCase caseOf(const JsonPlace& place, const CheckCase& defaults) {
  std::vector<std::string> keys{"name", "volume", "stored"};
  keys.insert(keys.end(), kSharedKeys.begin(), kSharedKeys.end());
  place.onlyKeys(keys);
  place.needs({"name", "volume"});
  CheckCase c = defaults;
  c.name = caseName(place["name"]);
  c.volume = volumePath(place["volume"]);
  readShared(place, c);
  c.stored = place.has("stored")
                 ? place.pathIn("stored")
                 : (std::filesystem::path(place.file).parent_path() / (c.name + ".vdb")).string();
  if (!c.max_rms && !c.max_abs) place.refuse("needs a limit: max_rms or max_abs");
  return c;
}

}  // namespace

std::vector<CheckCase> readCases(const std::string& path) {
  const nlohmann::json parsed = parseJson(readWholeFile(path, kLargestFile), path);
  const JsonPlace root{parsed, path, ""};
  root.onlyKeys({"defaults", "cases"});
  root.needs({"cases"});
  CheckCase defaults;
  if (root.has("defaults")) {
    root["defaults"].onlyKeys(kSharedKeys);
    readShared(root["defaults"], defaults);
  }
  const JsonPlace list = root["cases"];
  if (!list.value.is_array() || list.value.empty()) list.refuseType("a list of cases [ ]");
  std::vector<CheckCase> cases;
  std::set<std::string> names, stored;
  for (size_t i = 0; i < list.value.size(); ++i) {
    cases.push_back(caseOf(list[i], defaults));
    if (!names.insert(cases.back().name).second)
      list[i]["name"].refuse("is the name of another case as well");
    if (!stored.insert(cases.back().stored).second)
      list[i].refuse("its stored result is that of another case as well");
  }
  return cases;
}

}  // namespace vdb_diffuse
