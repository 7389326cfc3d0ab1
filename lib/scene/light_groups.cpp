#include "scene/light_groups.h"

#include <algorithm>

namespace vdb_diffuse {
namespace {

std::string asGridName(const std::string& text) {
  std::string name = text.substr(std::min(text.find_first_not_of('-'), text.size()));  // "--sun" is a sun
  for (char& c : name) {
    const bool kept = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                      c == '.' || c == '-' || c == '_';
    if (!kept) c = '_';
  }
  return name;
}

std::string kindOf(const Light& light) {
  constexpr const char* kKinds[] = {"sun", "point", "spot", "area", "dome"};
  static_assert(std::variant_size_v<Light> == 5);
  return kKinds[light.index()];
}

}  // namespace

std::vector<LightGroup> groupLights(const Scene& scene, bool emission) {
  std::vector<LightGroup> groups;
  const auto find = [&](const std::string& name) {
    return std::find_if(groups.begin(), groups.end(), [&](const LightGroup& g) { return g.name == name; });
  };
  const auto unused = [&](const std::string& name) {
    std::string free = name;
    for (int n = 2; find(free) != groups.end(); ++n) free = name + "_" + std::to_string(n);
    return free;
  };
  for (const NamedLight& light : scene.lights) {
    std::string name = asGridName(light.group.empty() ? light.name : light.group);
    if (name.empty()) name = unused(kindOf(light.light));
    auto group = find(name);
    if (group == groups.end()) group = groups.insert(group, {name, {}, false});
    group->lights.push_back(light);
  }
  if (emission) groups.push_back({unused("emission"), {}, true});
  return groups;
}

}  // namespace vdb_diffuse
