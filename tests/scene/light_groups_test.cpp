#include "scene/light_groups.h"

#include <gtest/gtest.h>

namespace vdb_diffuse {
namespace {

std::vector<std::string> namesOf(const std::vector<LightGroup>& groups) {
  std::vector<std::string> names;
  for (const LightGroup& group : groups) names.push_back(group.name);
  return names;
}
using Names = std::vector<std::string>;

TEST(LightGroups, LightsOfOneGroupOrNameStandTogether) {
  Scene scene;
  scene.lights = {{"key", SunLight{}, "warm"},
                  {"rim", SpotLight{}},
                  {"fill", PointLight{}, "warm"},
                  {"rim", PointLight{}}};
  const std::vector<LightGroup> groups = groupLights(scene, false);
  EXPECT_EQ(namesOf(groups), (Names{"warm", "rim"}));
  EXPECT_EQ(groups[0].lights[1].name, "fill");
  EXPECT_EQ(groups[1].lights.size(), 2u);
  for (const LightGroup& group : groups) EXPECT_FALSE(group.emission);
}

TEST(LightGroups, LightsWithoutNamesAreNumberedByKind) {
  Scene scene;
  scene.lights = {
      {"", SunLight{}}, {"", DomeLight{}}, {"", SunLight{}}, {"dome_2", PointLight{}}, {"", DomeLight{}}};
  EXPECT_EQ(namesOf(groupLights(scene, false)), (Names{"sun", "dome", "sun_2", "dome_2", "dome_3"}));
}

TEST(LightGroups, NamesCanStandInAGridsName) {
  Scene scene;
  scene.lights = {{"--sun", SunLight{}}, {"Lampe für Ü/1", PointLight{}}, {"a.b-c_1", PointLight{}}};
  EXPECT_EQ(namesOf(groupLights(scene, false)), (Names{"sun", "Lampe_f__r____1", "a.b-c_1"}));
}

TEST(LightGroups, TheMediumsOwnLightIsAGroupOfItsOwn) {
  Scene scene;
  scene.lights = {{"emission", SunLight{}}};
  const std::vector<LightGroup> groups = groupLights(scene, true);
  EXPECT_EQ(namesOf(groups), (Names{"emission", "emission_2"}));
  EXPECT_FALSE(groups[0].emission);
  EXPECT_TRUE(groups[1].emission);
  EXPECT_TRUE(groups[1].lights.empty());
}

}  // namespace
}  // namespace vdb_diffuse
