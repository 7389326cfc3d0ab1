#include "io/scene_file.h"

#include <gtest/gtest.h>

#include <cmath>

#include "io/gltf_scene.h"
#include "io/mesh_test_files.h"

namespace vdb_diffuse {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180;

SceneFile sceneOf(const std::string& json) {
  return readSceneFile(writeTestFile("scene.json", json));
}
std::string refused(const std::string& json) {
  return refusal([&] { sceneOf(json); });
}
std::string refusedLight(const std::string& light) {
  return refused(R"({"lights": [)" + light + "]}");
}

TEST(SceneFile, ReadsEveryKindOfLightInItsUnits) {
  const std::string panel = writeTestFile("panel.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const std::string name = panel.substr(panel.rfind('/') + 1);  // the scene lies in the same folder
  const SceneFile file = sceneOf(
      R"({"lights": [
        {"type": "sun", "direction": [0, 3, -4], "irradiance": 3.0, "angle": 0.53, "name": "noon"},
        {"type": "point", "position": [0, 0, 5], "intensity": [1, 2, 3], "radius": 0.1},
        {"type": "spot", "position": [1, 0, 5], "direction": [0, 0, -1e-200], "angle": 90, "blend": 0.25},
        {"type": "area", "mesh": ")" +
      name + R"(", "radiance": [5, 5, 4]},
        {"type": "dome", "radiance": 2, "rotation": -90}],
       "surfaces": [{"mesh": ")" +
      name + R"(", "albedo": 0.2, "name": "ground"}]})");
  ASSERT_EQ(file.scene.lights.size(), 5u);
  EXPECT_EQ(file.scene.lights[0].name, "noon");
  const auto& sun = std::get<SunLight>(file.scene.lights[0].light);
  EXPECT_LT((sun.direction - Vec3d(0, 0.6, -0.8)).length(), 1e-15);
  EXPECT_EQ(sun.irradiance, Vec3d(3));
  EXPECT_NEAR(sun.angle, 0.53 * kDegree, 1e-15);
  const auto& point = std::get<PointLight>(file.scene.lights[1].light);
  EXPECT_EQ(point.intensity, Vec3d(1, 2, 3));
  EXPECT_EQ(point.radius, 0.1);
  const auto& spot = std::get<SpotLight>(file.scene.lights[2].light);
  EXPECT_EQ(spot.direction, Vec3d(0, 0, -1));
  EXPECT_NEAR(spot.angle, kPi / 2, 1e-15);
  EXPECT_EQ(spot.blend, 0.25);
  EXPECT_EQ(std::get<AreaLight>(file.scene.lights[3].light).mesh.triangles.size(), 1u);
  EXPECT_EQ(std::get<AreaLight>(file.scene.lights[3].light).radiance, Vec3d(5, 5, 4));
  EXPECT_NEAR(std::get<DomeLight>(file.scene.lights[4].light).rotation, -kPi / 2, 1e-15);
  ASSERT_EQ(file.scene.surfaces.size(), 1u);
  EXPECT_EQ(file.scene.surfaces[0].name, "ground");
  EXPECT_EQ(file.scene.surfaces[0].albedo, Vec3d(0.2));
}

TEST(SceneFile, MediumKeepsDefaultsWhereNothingIsSaid) {
  const Optics none = opticsOf(sceneOf("{}").medium);
  EXPECT_EQ(none.sigma_s, Vec3d(1));
  EXPECT_EQ(none.sigma_a, Vec3d(0));
  EXPECT_EQ(none.g, 0);
  const MediumSettings some =
      sceneOf(R"({"medium": {"density": "smoke", "sigma_s": [1, 2, 3], "sigma_a": 0.01, "g": 0.85,
                             "emission": "flame", "emission_scale": 4}})")
          .medium;
  EXPECT_EQ(*some.density, "smoke");
  EXPECT_EQ(*some.emission, "flame");
  EXPECT_EQ(opticsOf(some).sigma_s, Vec3d(1, 2, 3));
  EXPECT_EQ(opticsOf(some).sigma_a, Vec3d(0.01));
  EXPECT_EQ(opticsOf(some).g, 0.85);
  EXPECT_EQ(opticsOf(some).emission_scale, 4);
}

TEST(SceneFile, ExtinctionAndAlbedoSplitIntoScatteringAndAbsorption) {
  const MediumSettings medium = sceneOf(R"({"medium": {"sigma_t": 8, "albedo": [1, 0.5, 0.25]}})").medium;
  EXPECT_EQ(*medium.sigma_s, Vec3d(8, 4, 2));
  EXPECT_EQ(*medium.sigma_a, Vec3d(0, 4, 6));
  EXPECT_TRUE(contains(refused(R"({"medium": {"sigma_t": 8}})"), "albedo"));
  EXPECT_TRUE(contains(refused(R"({"medium": {"sigma_t": 8, "albedo": 1, "sigma_a": 0}})"), "either"));
}

TEST(SceneFile, UnknownKeysAreNamedWithTheNearestKnownOne) {
  EXPECT_TRUE(contains(refused(R"({"ligths": []})"), "unknown key 'ligths', did you mean 'lights'?"));
  EXPECT_TRUE(contains(refused(R"({"medium": {"sigma_S": 1}})"),
                       "medium: unknown key 'sigma_S', did you mean 'sigma_s'?"));
  EXPECT_TRUE(contains(refusedLight(R"({"type": "sun", "direction": [0,0,-1], "iradiance": 1})"),
                       "lights[0]: unknown key 'iradiance', did you mean 'irradiance'?"));
  EXPECT_TRUE(contains(refusedLight(R"({"type": "spotlight"})"), "unknown light 'spotlight'"));
  EXPECT_TRUE(
      contains(refused(R"({"surfaces": [{"colour": 1}]})"), "unknown key 'colour'; known: mesh albedo"));
}

TEST(SceneFile, WrongValuesAreNamedByTheirPlace) {
  const struct {
    const char *json, *place;
  } cases[] = {
      {R"({"lights": [{"type": "dome"}, {"type": "dome"}, {"type": "sun", "direction": [0,0,-1], "angle": "wide"}]})",
       "lights[2].angle: expected a number, found \"wide\""},
      {R"({"lights": [{"type": "sun", "direction": [0,0,-1], "angle": -1}]})", "lights[0].angle: -1"},
      {R"({"lights": [{"type": "sun", "direction": [0,0,0]}]})", "lights[0].direction"},
      {R"({"lights": [{"type": "sun", "direction": [0,"a",0]}]})", "lights[0].direction[1]"},
      {R"({"lights": [{"type": "sun", "direction": [0,1]}]})", "lights[0].direction"},
      {R"({"lights": [{"type": "sun"}]})", "lights[0]: needs 'direction'"},
      {R"({"lights": [{"type": "sun", "direction": [0,0,-1], "irradiance": [1,-2,3]}]})",
       "lights[0].irradiance[1]"},
      {R"({"lights": [{"type": "point", "position": [0,0,0], "intensity": -1}]})", "lights[0].intensity"},
      {R"({"lights": [{"type": "point", "position": [0,0,0], "radius": -1}]})", "lights[0].radius"},
      {R"({"lights": [{"type": "spot", "position": [0,0,0], "direction": [0,0,1], "blend": 1.5}]})",
       "lights[0].blend"},
      {R"({"lights": [{"type": "spot", "position": [0,0,0], "direction": [0,0,1], "angle": 181}]})",
       "lights[0].angle"},
      {R"({"lights": [{"type": "spot", "position": [0,0,0], "direction": [0,0,1], "angle": 0}]})",
       "lights[0].angle"},
      {R"({"lights": [{"type": "dome", "radiance": [1,2]}]})", "lights[0].radiance"},
      {R"({"lights": [{"type": "dome", "image": 3}]})", "lights[0].image"},
      {R"({"lights": [{"type": 3}]})", "lights[0].type"},
      {R"({"lights": [3]})", "lights[0]: expected an object"},
      {R"({"lights": {}})", "lights: expected a list"},
      {R"({"surfaces": [{"albedo": 0.5}]})", "surfaces[0]: needs 'mesh'"},
      {R"({"medium": {"g": 1}})", "medium.g"},
      {R"({"medium": {"g": -1.5}})", "medium.g"},
      {R"({"medium": {"sigma_a": -0.1}})", "medium.sigma_a"},
      {R"({"medium": {"sigma_t": 1, "albedo": 1.1}})", "medium.albedo"},
      {R"({"medium": {"density": 7}})", "medium.density"},
      {R"({"medium": {"emission_scale": -7}})", "medium.emission_scale"},
      {R"([])", "expected an object"},
  };
  for (const auto& c : cases)
    EXPECT_TRUE(contains(refused(c.json), c.place)) << c.json << "\n" << refused(c.json);
}

TEST(SceneFile, FaultsOfFilesThatItNamesAreToldWithThePlaceOfTheName) {
  for (const auto& [json, place] :
       {std::pair(R"({"surfaces": [{"mesh": "none.obj"}]})", "scene.json: surfaces[0].mesh: "),
        std::pair(R"({"lights": [{"type": "area", "mesh": "none.obj"}]})", "scene.json: lights[0].mesh: "),
        std::pair(R"({"lights": [{"type": "dome", "image": "none.exr"}]})",
                  "scene.json: lights[0].image: ")}) {
    EXPECT_TRUE(contains(refused(json), place)) << refused(json);
    EXPECT_TRUE(contains(refused(json), "none.")) << refused(json);
  }
}

TEST(SceneFile, ASmallSceneThatNamesALargeMeshManyTimesIsRefused) {
  std::string mesh;
  for (int i = 0; i < 10000; ++i) mesh += "v " + std::to_string(i) + " " + std::to_string(i % 7) + " 0\n";
  for (int i = 1; i <= 9998; ++i)
    mesh += "f " + std::to_string(i) + " " + std::to_string(i + 1) + " " + std::to_string(i + 2) + "\n";
  const std::string path = writeTestFile("many.obj", mesh), name = path.substr(path.rfind('/') + 1);
  const Mesh one = readMesh(path);
  const auto naming = [&](size_t times) {
    std::string list;
    for (size_t i = 0; i < times; ++i) list += (i ? "," : "") + std::string(R"({"mesh": ")") + name + R"("})";
    return R"({"surfaces": [)" + list + "]}";
  };
  EXPECT_EQ(sceneOf(naming(3)).scene.surfaces[2].mesh.triangles.size(), one.triangles.size());
  const size_t bytes = 12 * one.triangles.size() + 24 * one.positions.size();
  const size_t last = (size_t(256) << 20) / bytes;  // surfaces[0] is the first, and none of the copies
  const std::string told = refused(naming(last + 10));
  EXPECT_TRUE(contains(told, "surfaces[" + std::to_string(last + 1) + "].mesh: ")) << told;
  EXPECT_TRUE(contains(told, "take more than 256 MB")) << told;
}

TEST(SceneFile, RefusesWhatIsNotAScene) {
  EXPECT_TRUE(contains(refused("{\"lights\": [}"), "not valid JSON"));
  EXPECT_TRUE(contains(refused(""), "not valid JSON"));
  EXPECT_TRUE(contains(refused("{\"medium\": {\"g\": 1e999}}"), "not valid JSON"));
  EXPECT_TRUE(contains(refused("{\"medium\": {\"density\": \"\xff\"}}"), "not valid JSON"));
  EXPECT_TRUE(contains(refused(R"({"lights": [], "lights": []})"), "'lights' stands twice"));
  EXPECT_TRUE(contains(refused(std::string(1000000, '[')), "nested deeper"));
  EXPECT_TRUE(contains(refusal([] { readSceneFile("/nowhere/a.json"); }), "/nowhere/a.json: no such file"));
  EXPECT_TRUE(contains(refusal([] { readSceneFile("a.blend"); }), ".json, .gltf and .glb"));
  EXPECT_TRUE(
      contains(refused(R"({"surfaces": [{"mesh": "no_such_mesh.obj"}]})"), "no_such_mesh.obj: no such file"));
}

TEST(GltfScene, MaterialsMakeSurfacesAndAreaLights) {
  TriangleGltf gltf;
  gltf.material = R"(, "material": 1)";
  gltf.materials =
      R"([{"name": "dark"}, {"name": "red", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0, 1]}}])";
  const Scene wall = readGltfScene(writeTestFile("wall.gltf", gltf.json()));
  ASSERT_EQ(wall.surfaces.size(), 1u);
  EXPECT_TRUE(wall.lights.empty());
  EXPECT_EQ(wall.surfaces[0].name, "wall");
  EXPECT_EQ(wall.surfaces[0].albedo, Vec3d(0.5, 0.25, 0));
  EXPECT_EQ(wall.surfaces[0].mesh.positions[2], Vec3d(0, 0, 1));

  gltf.materials = R"([{"name": "dark"}, {"name": "lamp", "emissiveFactor": [1, 0.5, 0.25],
      "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 20}}}])";
  const Scene lamp = readGltfScene(writeTestFile("lamp.gltf", gltf.json()));
  EXPECT_TRUE(lamp.surfaces.empty());
  ASSERT_EQ(lamp.lights.size(), 1u);
  EXPECT_EQ(std::get<AreaLight>(lamp.lights[0].light).radiance, Vec3d(20, 10, 5));

  gltf.materials = R"([{"name": "lamp"}, {"name": "lamp", "emissiveFactor": [1, 1, 1],
      "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 20}}}])";
  const std::string twins = writeTestFile("twins.gltf", gltf.json());
  EXPECT_TRUE(contains(refusal([&] { readGltfScene(twins); }), "two materials named 'lamp'"));
}

TEST(GltfScene, PunctualLightsComeInWattsWhereTheirNodesAre) {
  TriangleGltf gltf;
  // glTF's -z and y up; the lamp hangs twice, the second time under a node turned by 90 degrees about y.
  gltf.roots = "[0, 1, 3, 4]";
  gltf.nodes = R"([{"mesh": 0},
    {"translation": [1, 2, 3], "scale": [2, 2, 2], "children": [2]},
    {"translation": [0, 0, 1], "name": "lamp", "extensions": {"KHR_lights_punctual": {"light": 1}}},
    {"rotation": [0, 0.7071067811865476, 0, 0.7071067811865476], "extensions": {"KHR_lights_punctual": {"light": 2}}},
    {"matrix": [1,0,0,0, 0,0,-1,0, 0,1,0,0, 0,0,0,1], "extensions": {"KHR_lights_punctual": {"light": 0}}}])";
  gltf.extra =
      R"(, "extensionsUsed": ["KHR_lights_punctual"], "extensions": {"KHR_lights_punctual": {"lights": [
    {"type": "directional", "intensity": 683, "color": [1, 0.5, 0], "name": "sun"},
    {"type": "point", "intensity": 1366},
    {"type": "spot", "intensity": 683, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5}}]}})";
  const std::string path = writeTestFile("lights.gltf", gltf.json());

  const Scene scene = readGltfScene(path, Up::kY);
  ASSERT_EQ(scene.lights.size(), 3u);
  const auto& lamp = std::get<PointLight>(scene.lights[0].light);
  EXPECT_EQ(scene.lights[0].name, "lamp");
  EXPECT_EQ(lamp.position, Vec3d(1, 2, 5));
  EXPECT_LT((lamp.intensity - Vec3d(2)).length(), 1e-12);
  const auto& spot = std::get<SpotLight>(scene.lights[1].light);
  EXPECT_LT((spot.direction - Vec3d(-1, 0, 0)).length(), 1e-12);
  EXPECT_NEAR(spot.angle, 1.0, 1e-12);
  EXPECT_NEAR(std::cos(0.5) + spot.blend * (1 - std::cos(0.5)), std::cos(0.2), 1e-12) << "cos_inner";
  const auto& sun = std::get<SunLight>(scene.lights[2].light);
  EXPECT_LT((sun.direction - Vec3d(0, -1, 0)).length(), 1e-12);
  EXPECT_LT((sun.irradiance - Vec3d(1, 0.5, 0)).length(), 1e-12);

  const Scene turned = readSceneFile(path, Up::kZ).scene;
  EXPECT_EQ(std::get<PointLight>(turned.lights[0].light).position, Vec3d(1, -5, 2));
  EXPECT_LT((std::get<SunLight>(turned.lights[2].light).direction - Vec3d(0, 0, -1)).length(), 1e-12);
}

TEST(GltfScene, RefusesLightsWithoutMeaning) {
  const auto refusedWith = [](const std::string& light) {
    TriangleGltf gltf;
    gltf.nodes = R"([{"extensions": {"KHR_lights_punctual": {"light": 0}}}])";
    gltf.extra = R"(, "extensions": {"KHR_lights_punctual": {"lights": [)" + light + "]}}";
    const std::string path = writeTestFile("a.gltf", gltf.json());
    return refusal([&] { readGltfScene(path); });
  };
  EXPECT_EQ(refusedWith(R"({"type": "point"})"), "");
  EXPECT_NE(refusedWith(""), "") << "no such light";
  EXPECT_NE(refusedWith(R"({"type": "laser"})"), "");
  EXPECT_NE(refusedWith(R"({"type": "point", "intensity": -1})"), "");
  EXPECT_NE(refusedWith(R"({"type": "point", "intensity": "bright"})"), "");
  EXPECT_NE(refusedWith(R"({"type": "spot", "spot": {"innerConeAngle": 1, "outerConeAngle": 0.5}})"), "");
}

}  // namespace
}  // namespace vdb_diffuse
