#include "io/mesh_file.h"

#include <sys/stat.h>

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
