#include <gtest/gtest.h>
#include <sys/stat.h>

#include <limits>

#include "cli/run_program.h"
#include "hard/limited_run.h"
#include "io/image.h"
#include "io/triangle_gltf.h"

namespace vdb_diffuse {
namespace {

/// Files made to do harm, each given to the program under limits of time and memory.
class HostileFile : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    ASSERT_EQ(runProgram("make sphere -o " + path("volume.vdb") + " --voxels 500").status, 0);
    writeText(path("plate.obj"), kPlate + "f 1 2 3 4\n");
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  static std::string path(const std::string& name) { return folder_->file(name); }

  /// What becomes of a bake with this flag and file; of a refusal, its line without the path.
  static std::string fate(const std::string& flag, const std::string& name) {
    const std::string out = path("out.vdb");
    std::filesystem::remove(out);
    const LimitedRun run = runLimited({VDB_DIFFUSE_PROGRAM, "bake", path("volume.vdb"), "-o", out, "--sun",
                                       "1,0.5,-1", "--sweeps", "1", "--threads", "1", flag, path(name)},
                                      path(""));
    const std::string verdict = verdictOf(run, path(name), out);
    if (verdict != "refused") return verdict + ": " + run.error;
    return "refused: " + run.error.substr(run.error.find(path(name)) + path(name).size());
  }
  static void expectRefused(const std::string& flag, const std::string& name, const std::string& words) {
    const std::string what = fate(flag, name);
    EXPECT_EQ(what.rfind("refused: ", 0), 0u) << name << ": " << what;
    EXPECT_NE(what.find(words), std::string::npos) << name << ": " << words << " in: " << what;
  }
  static void expectRefused(const std::string& flag, const std::string& name, const std::string& bytes,
                            const std::string& words) {
    writeText(path(name), bytes);
    expectRefused(flag, name, words);
  }

  inline static const std::string kPlate = "v -6 -6 -6\nv 6 -6 -6\nv 6 6 -6\nv -6 6 -6\n";
  inline static TemporaryFolder* folder_ = nullptr;
};

std::string repeated(const std::string& part, int times) {
  std::string all;
  for (int n = 0; n < times; ++n) all += part;
  return all;
}

std::string exchanged(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST_F(HostileFile, ObjOfImpossibleNumbers) {
  for (const char* face : {"f 1 2 9", "f -1 -2 -9", "f 1 2 99999999999999999999", "f 0 1 2",
                           "f 1 2 -2147483648", "f a b c", "f 1"})
    EXPECT_EQ(fate("--occluder", (writeText(path("face.obj"), kPlate + face + "\n"), "face.obj"))
                  .rfind("refused", 0),
              0u)
        << face;
  for (const char* vertex : {"v nan 0 0", "v 1e300 0 0", "v inf 0 0", "v -1e999 0 0", "v 1e19 0 0"})
    expectRefused("--occluder", "vertex.obj", kPlate + vertex + "\nf 1 2 5\n", "vertex");
}

TEST_F(HostileFile, ObjOfGreatSizeIsReadOrRefusedInTime) {
  // One face of a million corners round a circle, and as many times the same three.
  std::string wheel = "v 0 0 0\n", same = kPlate + "f";
  for (int n = 0; n < 1000; ++n)
    wheel += "v " + std::to_string(std::cos(n)) + " " + std::to_string(std::sin(n)) + " -6\n";
  wheel += "f";
  for (int n = 0; n < 1'000'000; ++n) {
    wheel += " " + std::to_string(2 + n % 1000);
    same += n % 3 == 0 ? " 1" : n % 3 == 1 ? " 2" : " 3";
  }
  // A star of as many corners as are accepted, one after the other in and out.
  std::string star, corners = "f";
  for (int n = 0; n < 1000; ++n) {
    const double r = n % 2 ? 1 : 9, angle = 2 * M_PI * n / 1000;
    star += "v " + std::to_string(r * std::cos(angle)) + " " + std::to_string(r * std::sin(angle)) + " -6\n";
    corners += " " + std::to_string(n + 2);
  }
  star += corners;
  for (const auto& [name, text] : {std::pair("wheel.obj", wheel), std::pair("same.obj", same)}) {
    writeText(path(name), text + "\n");
    expectRefused("--occluder", name, "a face with 1000000 corners");
  }
  writeText(path("star.obj"), "v 0 0 0\n" + star + "\n");
  EXPECT_EQ(fate("--occluder", "star.obj"), "accepted: ");
  std::string materials = kPlate;
  for (int n = 0; n < 100'000; ++n)
    materials += "o " + std::to_string(n) + "\nusemtl " + std::to_string(n) + "\nv " +
                 std::to_string(1e-4 * n) + " " + std::to_string(n % 3) + " -9\nf -1 -2 -3\n";
  writeText(path("materials.obj"), materials);
  EXPECT_EQ(fate("--occluder", "materials.obj"), "accepted: ");
  // A comb of five hundred teeth, over and over.
  std::string comb, teeth = "f";
  for (int n = 0; n < 500; ++n)
    comb += "v " + std::to_string(2 * n) + " 0 0\nv " + std::to_string(2 * n + 1) + " 900 0\n";
  for (int n = 1; n <= 1000; ++n) teeth += " " + std::to_string(n);
  expectRefused("--occluder", "combs.obj", comb + repeated(teeth + "\n", 3000),
                "too many faces of many corners");
  expectRefused("--occluder", "line.obj", std::string(20'000'000, 'v'), "");
  expectRefused("--occluder", "binary.obj", std::string(1'000'000, '\0'), "");
}

TEST_F(HostileFile, SurfacesFarBeyondTheVolumeAreFollowedInTime) {
  writeText(path("far.obj"),
            "v -6 -6 -6e9\nv 6 -6 -6\nv 6 6 -6\nv -6 6 -6\nv 0 0 6e9\nv 6 6 6\nv -6 6 6\n"
            "f 1 2 3\nf 1 3 4\nf 5 6 7\nf 1 6 7\n");
  TriangleGltf far;
  far.nodes = R"([{"children": [1, 2]}, {"mesh": 0, "translation": [0, 1, 4294967296]}, {"mesh": 0}])";
  writeText(path("far.gltf"), far.json());
  EXPECT_EQ(fate("--occluder", "far.obj"), "accepted: ");
  EXPECT_EQ(fate("--scene", "far.gltf"), "accepted: ");
}

TEST_F(HostileFile, GltfTreesThatAreNone) {
  TriangleGltf chain, bomb, cycle, deep;
  chain.nodes = "[";
  for (int i = 1; i <= 100000; ++i) chain.nodes += "{\"children\": [" + std::to_string(i) + "]},";
  chain.nodes += "{\"mesh\": 0}]";
  bomb.nodes = "[";
  for (int i = 1; i <= 40; ++i)
    bomb.nodes += "{\"children\": [" + std::to_string(i) + "," + std::to_string(i) + "]},";
  bomb.nodes += "{\"mesh\": 0}]";
  cycle.nodes = R"([{"children": [1]}, {"children": [0], "mesh": 0}])";
  deep.extra = ", \"extras\": " + std::string(100000, '[') + std::string(100000, ']');
  for (const bool glb : {false, true}) {
    const auto refused = [&](const std::string& name, const TriangleGltf& gltf, const std::string& words) {
      expectRefused("--scene", name + (glb ? ".glb" : ".gltf"), glb ? gltf.glb() : gltf.json(), words);
    };
    refused("chain", chain, "nested deeper");
    refused("bomb", bomb, "two parents");
    refused("cycle", cycle, "cycle");
    refused("deep", deep, "nested deeper");
  }
}

TEST_F(HostileFile, GltfAccessorsBeyondTheirBuffers) {
  const std::string sound = TriangleGltf().json();
  for (const auto& [from, to] : {std::pair("\"count\": 3,", "\"count\": 3000000000,"),
                                 {"\"count\": 3,", "\"count\": 50000000,"},
                                 {"\"count\": 3,", "\"count\": -3,"},
                                 {"\"count\": 3,", "\"count\": 1e30,"},
                                 {"\"count\": 3,", "\"count\": 3, \"byteOffset\": -12,"},
                                 {"\"count\": 3,", "\"count\": 3, \"byteOffset\": 4294967295,"},
                                 {"\"count\": 3,", "\"count\": 3, \"byteOffset\": 18446744073709551600,"},
                                 {"\"byteLength\": 36", "\"byteLength\": 36, \"byteOffset\": -36"},
                                 {"\"byteLength\": 36", "\"byteLength\": 4294967295"},
                                 {"\"byteLength\": 36", "\"byteLength\": 36, \"byteStride\": 1000000000"},
                                 {"\"byteLength\": 44", "\"byteLength\": 4000000000"},
                                 {"\"bufferView\": 0", "\"bufferView\": 7"},
                                 {"\"buffer\": 0", "\"buffer\": -1"},
                                 {"\"componentType\": 5126", "\"componentType\": 1"},
                                 {"\"POSITION\": 0", "\"POSITION\": 99"},
                                 {"\"indices\": 1", "\"indices\": -1"},
                                 {"\"mesh\": 0", "\"mesh\": 4294967296"}}) {
    writeText(path("accessor.gltf"), exchanged(sound, from, to));
    EXPECT_EQ(fate("--scene", "accessor.gltf").rfind("refused: ", 0), 0u)
        << to << ": " << fate("--scene", "accessor.gltf");
  }
  std::string short_glb = TriangleGltf().glb();
  short_glb = exchanged(short_glb, "\"byteLength\": 44}]} ", "\"byteLength\":4400}]}");
  short_glb = exchanged(short_glb, "\"buffer\": 0, \"byteOffset\": 36", "\"buffer\": 0,\"byteOffset\":3600");
  expectRefused("--scene", "short.glb", short_glb, "");
  for (const char* sparse :
       {R"("count": 3, "sparse": {"count": 1000000000, "indices": {"bufferView": 1, "componentType": 5123},
           "values": {"bufferView": 0}},)",
        R"("count": 3, "sparse": {"count": 1, "indices": {"bufferView": 1, "byteOffset": 4000000,
           "componentType": 5123}, "values": {"bufferView": 0}},)",
        R"("count": 1, "sparse": {"count": 3, "indices": {"bufferView": 1, "componentType": 5123},
           "values": {"bufferView": 0}},)"}) {
    writeText(path("sparse.gltf"), exchanged(sound, "\"count\": 3,", sparse));
    EXPECT_EQ(fate("--scene", "sparse.gltf").rfind("refused: ", 0), 0u)
        << sparse << ": " << fate("--scene", "sparse.gltf");
  }
}

TEST_F(HostileFile, GltfBuffersElsewhere) {
  ASSERT_EQ(::mkfifo(path("pipe.bin").c_str(), 0600), 0);
  TriangleGltf gltf;
  const std::string whole = gltf.json(), uri = dataUri(gltf.buffer());
  for (const std::string& elsewhere :
       {std::string("../../../../../../../../etc/passwd"), std::string("file:///etc/passwd"),
        std::string("/dev/zero"), std::string("/dev/stdin"), path("pipe.bin"), std::string("pipe.bin"),
        std::string("."), std::string(""), std::string("http://localhost/x"), std::string(100000, 'x'),
        std::string("data:;base64,====")}) {
    writeText(path("uri.gltf"), exchanged(whole, uri, elsewhere));
    const std::string what = fate("--scene", "uri.gltf");
    // Bytes of a text file are numbers like any others; what must not be is to wait, or to be killed.
    EXPECT_TRUE(what.rfind("refused: ", 0) == 0 || what.rfind("accepted", 0) == 0)
        << elsewhere << ": " << what;
  }
}

// What is not read of a glTF file cannot do harm, whether it is sound or not.
TEST_F(HostileFile, GltfPartsThatAreNotRead) {
  TriangleGltf skin, camera, picture, media, transform, animation, morph, weights, name, plain;
  skin.nodes = R"([{"mesh": 0, "skin": 0}])";  // without inverseBindMatrices, which is sound
  skin.extra = R"(, "skins": [{"joints": [0]}])";
  weights.nodes = skin.nodes;
  weights.extra = R"(, "skins": [{"joints": [0], "inverseBindMatrices": 0}])";
  camera.nodes = R"([{"mesh": 0, "camera": 0}])";
  camera.extra = R"(, "cameras": [{"type": "perspective"}])";
  for (TriangleGltf* gltf : {&picture, &transform}) gltf->material = R"(, "material": 0)";
  picture.materials = R"([{"normalTexture": {"index": 0}}])";
  picture.extra = R"(, "textures": [{"source": 0}], "images": [{"uri": "data:image;base64,AAAA"}])";
  transform.materials = R"([{"normalTexture": {"extensions": {"KHR_texture_transform": {"offset": []}}}}])";
  transform.extra = R"(, "extensionsUsed": ["KHR_texture_transform"])";
  animation.extra =
      R"(, "animations": [{"samplers": [], "channels": [{"sampler": 7, "target": {"node": 0}}]}])";
  morph.material = R"(, "targets": [{"POSITION": 1}])";
  for (const TriangleGltf& gltf : {skin, weights, camera, picture, transform, animation, morph}) {
    writeText(path("part.gltf"), gltf.json());
    EXPECT_EQ(fate("--scene", "part.gltf"), "accepted: ") << gltf.json();
  }
  const std::string sound = plain.json();
  for (const auto& [from, to] :
       {std::pair("\"attributes\": {", R"("attributes": {"JOINTS_0": 1, "WEIGHTS_0": 0, "COLOR_0": 1, )"),
        {"\"attributes\": {",
         R"("extensions": {"KHR_draco_mesh_compression": {"bufferView": 0}}, "attributes": {)"},
        {"data:application/octet-stream;",
         "data:application/"
         "vnd.a-type-of-media-of-more-than-127-characters-which-is-where-the-sign-of-a-character"
         "-changes-from-plus-to-minus-in-one-reader;"}}) {
    writeText(path("part.gltf"), exchanged(sound, from, to));
    EXPECT_EQ(fate("--scene", "part.gltf"), "accepted: ") << to;
  }
  const std::string primitive = R"({"attributes": {"POSITION": 0}, "indices": 1})";
  writeText(path("part.gltf"), exchanged(sound, "{\"primitives\": [" + primitive,
                                         "{\"name\": \"" + std::string(1023, 'n') + "\", \"primitives\": [" +
                                             primitive + "," + primitive));
  EXPECT_EQ(fate("--scene", "part.gltf"), "accepted: ") << "a long name";
}

TEST_F(HostileFile, GltfStripsAndLoopsOfTooFewCorners) {
  TriangleGltf gltf;
  for (uint16_t& index : gltf.indices) index = 9;  // no such vertex
  for (const int mode : {2, 3}) {
    gltf.material = ", \"mode\": " + std::to_string(mode);
    writeText(path("line.gltf"), gltf.json());
    EXPECT_EQ(fate("--scene", "line.gltf"), "accepted: ") << "lines are not read, mode " << mode;
  }
  gltf.indices[0] = 0;
  for (const int mode : {5, 6})
    for (const char* count : {"0", "1"}) {
      gltf.material = ", \"mode\": " + std::to_string(mode);
      writeText(path("strip.gltf"), exchanged(gltf.json(), "\"count\": 3, \"type\": \"SCALAR\"",
                                              std::string("\"count\": ") + count + ", \"type\": \"SCALAR\""));
      EXPECT_EQ(fate("--scene", "strip.gltf"), "accepted: ") << "no triangle, mode " << mode;
    }
}

// A thousand primitives that share the same million indices.
TEST_F(HostileFile, GltfThatNamesOneBufferOften) {
  const std::string primitive = R"({"attributes": {"POSITION": 0}, "indices": 1})";
  std::string text = TriangleGltf().json();
  for (const auto& [from, to] :
       {std::pair(primitive, primitive + repeated("," + primitive, 1000)),
        {dataUri(TriangleGltf().buffer()), dataUri(TriangleGltf().buffer() + std::string(1'000'000, '\0'))},
        {R"("byteLength": 44)", R"("byteLength": 1000044)"},
        {R"("byteLength": 6)", R"("byteLength": 1000000)"},
        {R"("componentType": 5123, "count": 3)", R"("componentType": 5121, "count": 1000000)"}})
    text = exchanged(text, from, to);
  expectRefused("--scene", "many.gltf", text, "more than 50000000 triangles");
}

TEST_F(HostileFile, ExrThatPromisesMoreThanItHolds) {
  Image image{64, 32, std::vector<Vec3f>(64 * 32, Vec3f(1))};
  writeExr(path("sound.exr"), image);
  const std::string sound = contentsOf(path("sound.exr"));
  EXPECT_EQ(fate("--env", "sound.exr"), "accepted: ");
  const size_t window = sound.find("dataWindow") + 11 + 6 + 4,
               display = sound.find("displayWindow") + 14 + 6 + 4;
  for (const int32_t size : {std::numeric_limits<int32_t>::max(), 1 << 20, 11584, 5000, -1}) {
    std::string bytes = sound;
    for (const size_t at : {window, display})
      for (const size_t place : {at + 8, at + 12})
        bytes.replace(place, 4, reinterpret_cast<const char*>(&size), 4);
    expectRefused("--env", "window.exr", bytes, "");
  }
  for (const float bad : {NAN, INFINITY, -1.0f}) {
    image.pixels[100][1] = bad;
    writeExr(path("pixels.exr"), image);
    expectRefused("--env", "pixels.exr", "1 pixels are NaN");
  }
  expectRefused("--env", "cut.exr", sound.substr(0, sound.size() - 9), "");
}

TEST_F(HostileFile, ScenesOfNoSense) {
  const auto refused = [&](const std::string& text, const std::string& words) {
    expectRefused("--scene", "scene.json", text, words);
  };
  refused(repeated("[", 100000), "nested deeper");
  refused(repeated("{\"a\":", 100000), "nested deeper");
  refused("{\"lights\": [" + repeated("0,", 21'000'000) + "0]}", "");
  refused("{\"lights\": [], \"lights\": []}", "twice");
  refused(R"({"medium": {"g": NaN}})", "not valid JSON");
  refused(R"({"medium": {"g": 1e999}})", "");
  refused(R"({"medium": {"sigma_s": "1"}})", "medium.sigma_s");
  refused(R"({"medium": {"sigma_s": [1, 1]}})", "medium.sigma_s");
  refused(R"({"medium": {"sigma_s": -1}})", "medium.sigma_s");
  refused("{\"medium\": {\"density\": \"\xff\xfe\"}}", "");
  refused("\xef\xbb\xbf\xff{}", "");
  refused("{\"" + std::string(1'000'000, 'k') + "\": 1}", "unknown key");
  refused("{\"lights\": [{\"type\": \"" + std::string(1'000'000, 't') + "\"}]}", "unknown light");
  refused(R"({"lights": [{"type": "sun", "direction": [0, 0, -1], "irradience": 3}]})", "irradiance");
  refused("[]", "");
  refused("null", "");
  refused("", "");
  refused(std::string(1000, '\0'), "");
  refused(R"({"surfaces": [{"mesh": "."}]})", "surfaces[0].mesh");
  refused(R"({"surfaces": [{"mesh": "/dev/zero.obj"}]})", "surfaces[0].mesh");
  refused(R"({"lights": [{"type": "dome", "image": "/dev/zero"}]})", "lights[0].image");
  refused("{\"surfaces\": [{\"mesh\": \"" + std::string(100000, 'm') + ".obj\"}]}", "surfaces[0].mesh");
  refused("{\"surfaces\": [{\"mesh\": \"plate.obj\\u0000.obj\"}]}", "surfaces[0].mesh");
}

// Light so strong or weak that no float holds what becomes of it is refused, or gives finite numbers.
TEST_F(HostileFile, ScenesOfExtremeLight) {
  for (const char* power : {"1e-320", "1e-60", "1e30", "1e38", "1e60", "1e300"})
    for (const std::string light : {R"({"type": "sun", "direction": [0, 0, -1], "irradiance": POWER})",
                                    R"({"type": "point", "position": [0, 0, 8], "intensity": POWER})",
                                    R"({"type": "point", "position": [POWER, 0, 8], "intensity": 1})",
                                    R"({"type": "point", "position": [0, 0, 8], "radius": POWER})",
                                    R"({"type": "area", "mesh": "plate.obj", "radiance": POWER})",
                                    R"({"type": "dome", "radiance": [POWER, 1, 0]})"}) {
      writeText(path("light.json"), "{\"lights\": [" + exchanged(light, "POWER", power) + "]}");
      const std::string what = fate("--scene", "light.json");
      EXPECT_TRUE(what.rfind("refused: ", 0) == 0 || what.rfind("accepted: ", 0) == 0)
          << light << " " << power << ": " << what;
    }
}

TEST_F(HostileFile, WhatIsNoRegularFileIsRefusedAtOnce) {
  for (const auto& [flag, extension] : {std::pair("--occluder", ".obj"),
                                        {"--occluder", ".glb"},
                                        {"--scene", ".json"},
                                        {"--scene", ".gltf"},
                                        {"--env", ".exr"}}) {
    const std::string folder = std::string("folder") + extension, pipe = std::string("pipe") + extension;
    ::mkdir(path(folder).c_str(), 0700);
    ::mkfifo(path(pipe).c_str(), 0600);
    expectRefused(flag, folder, "not a regular file");
    expectRefused(flag, pipe, "not a regular file");
    std::filesystem::create_symlink("/dev/zero", path(std::string("zero") + flag + extension));
    expectRefused(flag, std::string("zero") + flag + extension, "not a regular file");
    expectRefused(flag, std::string("none") + extension, "");
  }
}

}  // namespace
}  // namespace vdb_diffuse
