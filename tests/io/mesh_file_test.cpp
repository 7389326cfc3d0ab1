#include "io/mesh_file.h"

#include <sys/stat.h>

#include <array>
#include <cmath>
#include <limits>

#include "io/mesh_test_files.h"

namespace vdb_diffuse {
namespace {

std::string refused(const std::string& path) {
  return refusal([&] { readMesh(path); });
}

double areaOf(const Mesh& mesh) {
  double area = 0;
  for (const auto& t : mesh.triangles)
    area += 0.5 * (mesh.positions[t[1]] - mesh.positions[t[0]])
                      .cross(mesh.positions[t[2]] - mesh.positions[t[0]])
                      .length();
  return area;
}

Vec3d normalOf(const Mesh& mesh, size_t t = 0) {
  const auto& c = mesh.triangles.at(t);
  return (mesh.positions[c[1]] - mesh.positions[c[0]])
      .cross(mesh.positions[c[2]] - mesh.positions[c[0]])
      .unit();
}

constexpr const char* kPanel = "v -1 -1 2\nv 1 -1 2\nv 1 1 2\nv -1 1 2\nv 0 3 2\n";

TEST(MeshFile, ObjPolygonsBecomeTrianglesOfTheSameAreaAndSide) {
  // A square with a gable: a pentagon of area 6, counter-clockwise seen from +z.
  const Mesh mesh = readMesh(writeTestFile("gable.obj", std::string(kPanel) + "f 1 2 3 5 4\n"));
  EXPECT_EQ(mesh.triangles.size(), 3u);
  EXPECT_NEAR(areaOf(mesh), 6, 1e-6);
  for (size_t t = 0; t < 3; ++t) EXPECT_LT((normalOf(mesh, t) - Vec3d(0, 0, 1)).length(), 1e-6);
  for (const Vec3d& p : mesh.positions) EXPECT_EQ(p[2], 2) << "OBJ is not turned";
}

TEST(MeshFile, ObjGroupsAndMaterialsBecomeOneMesh) {
  const Mesh mesh = readMesh(writeTestFile(
      "two.obj", std::string(kPanel) + "mtllib /dev/zero\no a\nf 1 2 3\no b\nusemtl none\nf -5 -3 -2\n"));
  EXPECT_EQ(mesh.triangles.size(), 2u);
  EXPECT_NEAR(areaOf(mesh), 4, 1e-6);
}

TEST(MeshFile, ObjLinesMayBeJoinedCommentedAndEndAsElsewhere) {
  const std::string plain = "v 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\n";
  for (const char* text :
       {"v 0 0 0\r\nv 2 0 0\r\nv 0 2 0\r\nf 1 2 3\r\n", "v 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3",
        "\t v\t0 0 0\nv 2 \\\n0 0\nv 0 2 0 #last\nf 1 \\\r\n 2 \\\n 3 # whole\n",
        "f 1 2 3\nv 0 0 0\nv 2 0 0\nv 0 2 0\n", "v 0 0 0 1\nv +4 0 0 2\nv 0 1e0 0 0.5\nf 1/7 2/8/9 3//9\n",
        "v 0 0 0 1 0 0\nv 2 0 0 0.5 0.5 0.5\nv 0 2 0 0 0 0.5\nvt 5 5\nvn 0 0 nan\nf 1 2 3\nl 1 2\nf 1 2\np "
        "1\n",
        "g v f\nusemtl f\nv 9 9 9\nv 0 0 0\nv 2 0 0\nv 0 2 0\nf -3 -2 -1\n"}) {
    const Mesh mesh = readMesh(writeTestFile("a.obj", text));
    ASSERT_EQ(mesh.triangles.size(), 1u) << text;
    EXPECT_NEAR(areaOf(mesh), 2, 1e-12) << text;
    EXPECT_LT((normalOf(mesh) - Vec3d(0, 0, 1)).length(), 1e-12) << text;
  }
  for (const auto& [text, words] : {std::pair("v 0 0\nf 1 1 1\n", "line 1: a vertex is three numbers"),
                                    {"v 1 2 3x\nf 1 1 1\n", "line 1: a vertex is three numbers"},
                                    {"v 1 2 3\n#\nv 1 \\\n2 3 0\nf 1 2 2\n", "homogeneous"},
                                    {"v 1 2 3\nv 1 \\\n2 3\nf 1 2 0\n", "line 4: there is no vertex '0'"},
                                    {"v 1 2 3\nf 1 -2 1\n", "no vertex '-2'"},
                                    {"v 1 2 3\nf 1 1 2\n", "line 2: there is no vertex 2 among 1"},
                                    {"f 1 2 3 4\n", "no vertex 4 among 0"}})
    EXPECT_TRUE(contains(refused(writeTestFile("a.obj", text)), words))
        << text << refused(writeTestFile("a.obj", text));
}

TEST(MeshFile, GltfIsTurnedToTheAxisThatPointsUp) {
  TriangleGltf gltf;
  gltf.positions[8] = 5;  // the third corner: (0, 1, 5)
  for (const std::string& path : {writeTestFile("a.gltf", gltf.json()), writeTestFile("a.glb", gltf.glb())}) {
    const Mesh z_up = readMesh(path), y_up = readMesh(path, Up::kY);
    ASSERT_EQ(z_up.triangles.size(), 1u);
    EXPECT_EQ(y_up.positions[2], Vec3d(0, 1, 5));
    EXPECT_EQ(z_up.positions[2], Vec3d(0, -5, 1));
    EXPECT_LT((normalOf(y_up) - Vec3d(0, -5, 1).unit()).length(), 1e-12);
    EXPECT_LT((normalOf(z_up) - Vec3d(0, -1, -5).unit()).length(), 1e-12) << "a rotation keeps the front";
  }
}

TEST(MeshFile, NodeTransformsNestAndMirrorsKeepTheFront) {
  TriangleGltf gltf;
  gltf.nodes = R"([{"children": [1, 2], "scale": [2, 2, 2], "translation": [10, 0, 0]},
                   {"mesh": 0, "translation": [0, 1, 0]}, {"mesh": 0, "scale": [-1, 1, 1]}])";
  const Mesh mesh = readMesh(writeTestFile("a.gltf", gltf.json()), Up::kY);
  ASSERT_EQ(mesh.triangles.size(), 2u);
  EXPECT_NEAR(areaOf(mesh), 4, 1e-6);
  EXPECT_EQ(mesh.positions[mesh.triangles[0][0]], Vec3d(10, 2, 0));
  for (size_t t : {0, 1}) EXPECT_LT((normalOf(mesh, t) - Vec3d(0, 0, 1)).length(), 1e-12) << t;
}

/// Four corners of a square, each at a stride of 16 bytes, and one index of one byte for each.
std::string squareGltf(int mode, bool indexed, const std::string& more = "") {
  std::string bytes;
  for (const auto& corner :
       {std::array<float, 4>{0, 0, 0, NAN}, {1, 0, 0, NAN}, {0, 1, 0, NAN}, {1, 1, 0, NAN}})
    bytes.append(reinterpret_cast<const char*>(corner.data()), 16);
  bytes += mode == 6 ? std::string("\0\1\3\2", 4) : std::string("\0\1\2\3", 4);
  return R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                  {"bufferView": 1, "componentType": 5121, "count": 4, "type": "SCALAR"}],
    "bufferViews": [{"buffer": 0, "byteLength": 64, "byteStride": 16}, {"buffer": 0, "byteOffset": 64, "byteLength": 4}],
    "buffers": [{"byteLength": 68, "uri": ")" +
         dataUri(bytes) + R"("}], "meshes": [{"primitives": [{"mode": )" + std::to_string(mode) +
         (indexed ? R"(, "indices": 1)" : "") + R"(, "attributes": {"POSITION": 0}}]}])" + more + "}";
}

TEST(MeshFile, GltfStripsAndFansAreTakenApartWithTheirFrontOnOneSide) {
  for (const auto& [mode, indexed] : {std::pair(5, true), {5, false}, {6, true}}) {
    const Mesh mesh = readMesh(writeTestFile("a.gltf", squareGltf(mode, indexed)), Up::kY);
    ASSERT_EQ(mesh.triangles.size(), 2u) << mode;
    EXPECT_NEAR(areaOf(mesh), 1, 1e-12) << mode;
    for (size_t t : {0, 1})
      EXPECT_LT((normalOf(mesh, t) - Vec3d(0, 0, 1)).length(), 1e-12) << mode << " " << t;
  }
  EXPECT_EQ(readMesh(writeTestFile("a.gltf", squareGltf(4, true))).triangles.size(), 1u)
      << "a corner is left";
  for (const int mode : {0, 1, 2, 3})
    EXPECT_TRUE(contains(refused(writeTestFile("a.gltf", squareGltf(mode, true))), "no triangles")) << mode;
  EXPECT_NE(refused(writeTestFile("a.gltf", squareGltf(7, true))), "");
}

TEST(MeshFile, GltfBuffersMayLieBesideIt) {
  TriangleGltf gltf;
  const std::string path = writeTestFile("a.gltf", ""), buffer = writeTestFile("buffer.bin", gltf.buffer());
  const std::string uri = buffer.substr(buffer.rfind('/') + 1);
  std::string text = gltf.json();
  text.replace(text.find("data:"), dataUri(gltf.buffer()).size(), uri);
  writeTestFile("a.gltf", text);
  EXPECT_NEAR(areaOf(readMesh(path)), 0.5, 1e-12);
  writeTestFile("buffer.bin", gltf.buffer().substr(0, 43));
  EXPECT_TRUE(contains(refused(path), "43 bytes, not the 44"));
  ::unlink(buffer.c_str());
  EXPECT_TRUE(contains(refused(path), uri + ": no such file"));
}

TEST(MeshFile, RefusesCompressedAndQuantizedMeshesByName) {
  TriangleGltf gltf;
  const auto exchanged = [&](const std::string& from, const std::string& to) {
    std::string text = gltf.json();
    return refused(writeTestFile("a.gltf", text.replace(text.find(from), from.size(), to)));
  };
  EXPECT_TRUE(contains(exchanged(R"("bufferView": 0, "componentType": 5126)", R"("componentType": 5126)"),
                       "export without compression"));
  EXPECT_TRUE(contains(exchanged("5126", "5122"), "export without quantization"));
  EXPECT_TRUE(contains(exchanged("5123", "5122"), "whole numbers"));
}

TEST(MeshFile, RefusesWhatIsNotAFileOfTrianglesAndNamesIt) {
  const std::string folder = ::testing::TempDir() + "folder.obj";
  ::mkdir(folder.c_str(), 0700);
  const std::string fifo = ::testing::TempDir() + "fifo.obj";
  ::mkfifo(fifo.c_str(), 0600);
  for (const std::string& path :
       {std::string("/nowhere/missing.obj"), folder, fifo, writeTestFile("empty.obj", ""),
        writeTestFile("empty.glb", ""), writeTestFile("points.obj", kPanel),
        writeTestFile("ball.xyz", kPanel), writeTestFile("garbage.obj", "\x01\x02\xff what is this\n"),
        writeTestFile("garbage.gltf", "{\"asset\":"),
        writeTestFile("garbage.glb", "glTF\x02 and then nothing much at all"),
        writeTestFile("none.gltf", R"({"asset": {"version": "2.0"}})"),
        writeTestFile("old.gltf", R"({"asset": {"version": "1.0"}, "nodes": {}})")})
    EXPECT_TRUE(contains(refused(path), path)) << path << ": " << refused(path);
  ::unlink(fifo.c_str());
}

TEST(MeshFile, RefusesIndicesOutOfRangeAndVerticesThatAreNotFinite) {
  EXPECT_NE(refused(writeTestFile("index.obj", std::string(kPanel) + "f 1 2 9\n")), "");
  EXPECT_NE(refused(writeTestFile("nan.obj", std::string("v nan 0 0\n") + kPanel + "f 1 2 3\n")), "");
  TriangleGltf out_of_range, nan, infinite;
  out_of_range.indices[1] = 3;
  nan.positions[4] = std::numeric_limits<float>::quiet_NaN();
  infinite.positions[0] = std::numeric_limits<float>::infinity();
  EXPECT_NE(refused(writeTestFile("index.gltf", out_of_range.json())), "");
  EXPECT_TRUE(contains(refused(writeTestFile("nan.glb", nan.glb())), "vertex 1"));
  EXPECT_TRUE(contains(refused(writeTestFile("inf.glb", infinite.glb())), "vertex 0"));
}

TEST(MeshFile, RefusesDeepJsonCyclesAndInstanceBombs) {
  TriangleGltf deep;
  deep.extra = ", \"extras\": " + std::string(100000, '[') + std::string(100000, ']');
  EXPECT_TRUE(contains(refused(writeTestFile("deep.gltf", deep.json())), "nested deeper"));

  TriangleGltf cycle;
  cycle.nodes = R"([{"children": [1]}, {"children": [0], "mesh": 0}])";
  EXPECT_TRUE(contains(refused(writeTestFile("cycle.gltf", cycle.json())), "cycle"));

  TriangleGltf twice;
  twice.roots = "[0, 0]";
  EXPECT_TRUE(contains(refused(writeTestFile("twice.gltf", twice.json())), "twice"));

  TriangleGltf bomb, chain;
  bomb.nodes = chain.nodes = "[";
  for (int i = 1; i <= 40; ++i)
    bomb.nodes += "{\"children\": [" + std::to_string(i) + "," + std::to_string(i) + "]},";
  for (int i = 1; i <= 100000; ++i) chain.nodes += "{\"children\": [" + std::to_string(i) + "]},";
  bomb.nodes += "{\"mesh\": 0}]";
  chain.nodes += "{\"mesh\": 0}]";
  EXPECT_TRUE(contains(refused(writeTestFile("bomb.gltf", bomb.json())), "two parents"));
  EXPECT_TRUE(contains(refused(writeTestFile("chain.gltf", chain.json())), "nested deeper"));

  TriangleGltf huge;
  std::string text = huge.json();
  text.replace(text.find("\"count\": 3"), 10, "\"count\": 3000000000");
  EXPECT_TRUE(contains(refused(writeTestFile("huge.gltf", text)), "3000000000"));
}

TEST(MeshFile, EveryTruncationIsRefused) {
  const std::string whole = TriangleGltf().glb();
  for (size_t size = 0; size < whole.size(); size += 7)
    EXPECT_NE(refused(writeTestFile("cut.glb", whole.substr(0, size))), "") << size;
}

}  // namespace
}  // namespace vdb_diffuse
