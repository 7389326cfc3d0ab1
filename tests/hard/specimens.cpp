#include "hard/specimens.h"

#include <ImfChannelList.h>
#include <ImfCompression.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfTiledOutputFile.h>

#include <cmath>
#include <stdexcept>

#include "io/image.h"
#include "io/temporary_folder.h"
#include "io/triangle_gltf.h"
#include "io/vdb_writer.h"
#include "shapes/solids.h"
#include "vdb/corpus.h"

namespace vdb_diffuse {
namespace {

/// The bytes that write(path) leaves.
template <typename Write>
std::string bytesOf(const Write& write, const std::string& name = "file") {
  const TemporaryFolder folder;
  write(folder.file(name));
  return contentsOf(folder.file(name));
}

std::string smallVolume() {
  return bytesOf([](const std::string& path) { writeVolume(path, makeSphere({2000}), {}); });
}

std::vector<std::string> soundVdbs() {
  std::vector<std::string> files;
  for (const VdbSpecimen& specimen : vdbCorpus()) files.push_back(bytesOf(specimen.write));
  return files;
}

constexpr const char* kPlate = "v -6 -6 -6\nv 6 -6 -6\nv 6 6 -6\nv -6 6 -6\n";

std::vector<std::string> soundObjs() {
  std::string sheet = "# a bent sheet\no sheet\n", faces;
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j) {
      sheet += "v " + std::to_string(2 * i - 4) + " " + std::to_string(2 * j - 4) + " " +
               std::to_string(-6 + 0.1 * i * j) + "\n";
      const int n = 5 * i + j + 1;
      if (i < 4 && j < 4)
        faces += "f " + std::to_string(n) + " " + std::to_string(n + 1) + " " + std::to_string(n + 6) + " " +
                 std::to_string(n + 5) + "\n";
    }
  return {std::string(kPlate) + "f 1 2 3 4\n", sheet + faces,
          std::string(kPlate) + "vn 0 0 1\nvt 0 0\nvt 1 1\ng a\nusemtl none\ns 1\nf 1/1/1 2/2/1 3/1/1\n" +
              "g b\nf -4//1 -2//1 -1//1\nl 1 2\np 1\n"};
}

/// Triangle files with a transform, a light, materials.
std::vector<TriangleGltf> soundGltfs() {
  TriangleGltf plain, placed, lit, strip;
  placed.nodes = R"([{"children": [1, 2], "scale": [2, 2, 2], "translation": [-3, 0, -6]},
                    {"mesh": 0, "translation": [0, 1, 0], "rotation": [0, 0.6, 0, 0.8]},
                    {"mesh": 0, "matrix": [-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}])";
  lit.nodes = R"([{"mesh": 0, "name": "wall"}, {"translation": [0, 8, 0],
                 "extensions": {"KHR_lights_punctual": {"light": 0}}}])";
  lit.roots = "[0, 1]";
  lit.material = R"(, "material": 0)";
  lit.materials = R"([{"name": "lamp", "emissiveFactor": [1, 0.5, 0.2],
                     "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3}},
                     "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]}}])";
  lit.extra = R"(, "extensionsUsed": ["KHR_lights_punctual"], "extensions": {"KHR_lights_punctual": {"lights":
               [{"type": "spot", "intensity": 7000, "color": [1, 1, 0.5],
                 "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.7}}]}})";
  strip.material = R"(, "mode": 5)";
  return {plain, placed, lit, strip};
}

/// A picture of 24 x 16 floats, or halves, packed as told; in tiles of 8 x 8 if wanted.
std::string exrOf(Imf::Compression compression, Imf::PixelType type, bool tiled) {
  constexpr int kWidth = 24, kHeight = 16;
  std::vector<float> floats(3 * kWidth * kHeight);
  for (size_t i = 0; i < floats.size(); ++i) floats[i] = 1.2f + std::sin(0.1f * static_cast<float>(i));
  std::vector<Imath::half> halves(floats.begin(), floats.end());
  const bool half = type == Imf::HALF;
  char* base = half ? reinterpret_cast<char*>(halves.data()) : reinterpret_cast<char*>(floats.data());
  const size_t size = half ? sizeof(Imath::half) : sizeof(float);
  Imf::Header header(kWidth, kHeight);
  header.compression() = compression;
  Imf::FrameBuffer buffer;
  const char* names[] = {"R", "G", "B"};
  for (int c = 0; c < 3; ++c) {
    header.channels().insert(names[c], Imf::Channel(type));
    buffer.insert(names[c], Imf::Slice(type, base + c * size, 3 * size, 3 * size * kWidth));
  }
  return bytesOf([&](const std::string& path) {
    if (tiled) {
      header.setTileDescription(Imf::TileDescription(8, 8));
      Imf::TiledOutputFile file(path.c_str(), header);
      file.setFrameBuffer(buffer);
      file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
    } else {
      Imf::OutputFile file(path.c_str(), header);
      file.setFrameBuffer(buffer);
      file.writePixels(kHeight);
    }
  });
}

std::vector<std::string> soundExrs() {
  std::vector<std::string> files;
  for (const auto& [compression, type] : {std::pair(Imf::NO_COMPRESSION, Imf::FLOAT),
                                          {Imf::RLE_COMPRESSION, Imf::HALF},
                                          {Imf::ZIP_COMPRESSION, Imf::FLOAT},
                                          {Imf::PIZ_COMPRESSION, Imf::HALF},
                                          {Imf::PXR24_COMPRESSION, Imf::FLOAT},
                                          {Imf::B44_COMPRESSION, Imf::HALF},
                                          {Imf::DWAA_COMPRESSION, Imf::HALF}})
    for (const bool tiled : {false, true}) files.push_back(exrOf(compression, type, tiled));
  return files;
}

std::vector<std::string> soundScenes() {
  return {R"({
  "medium": { "density": "density", "sigma_s": [1, 0.9, 0.8], "sigma_a": 0.01, "g": 0.6 },
  "lights": [
    { "type": "sun", "name": "noon", "direction": [0.5, 0.3, -0.8], "irradiance": 3.0, "angle": 0.53 },
    { "type": "dome", "radiance": 0.5, "image": "sky.exr", "rotation": 30 }
  ],
  "surfaces": [ { "name": "plate", "mesh": "plate.obj", "albedo": 0.2 } ]
})",
          R"({
  "medium": { "sigma_t": 1.5, "albedo": [0.9, 0.8, 0.7], "g": -0.3 },
  "lights": [
    { "type": "point", "position": [0, 0, 8], "intensity": 100, "radius": 0.1 },
    { "type": "spot", "position": [1, 0, 8], "direction": [0, 0, -1], "intensity": 50, "angle": 45, "blend": 0.2 },
    { "type": "area", "mesh": "plate.obj", "radiance": [5, 5, 4] }
  ]
})"};
}

std::vector<std::string> onScene(const std::string& flag) {
  return {"VOLUME", flag, "FILE", "--sun", "1,0.5,-1", "--sweeps", "1"};
}

}  // namespace

SpecimenKind specimenKind(const std::string& name) {
  if (name == "vdb") return {name, "in.vdb", false, soundVdbs(), {}, {"FILE", "--sun", "1,0.5,-1"}};
  const std::map<std::string, std::string> volume{{"volume.vdb", smallVolume()}};
  if (name == "obj") return {name, "in.obj", true, soundObjs(), volume, onScene("--occluder")};
  if (name == "exr") return {name, "in.exr", false, soundExrs(), volume, {"VOLUME", "--env", "FILE"}};
  if (name == "gltf" || name == "glb") {
    std::vector<std::string> sound;
    for (const TriangleGltf& gltf : soundGltfs()) sound.push_back(name == "glb" ? gltf.glb() : gltf.json());
    return {name, "in." + name, name == "gltf", sound, volume, onScene("--scene")};
  }
  if (name == "json") {
    auto beside = volume;
    beside["plate.obj"] = std::string(kPlate) + "f 1 2 3 4\n";
    beside["sky.exr"] = exrOf(Imf::ZIP_COMPRESSION, Imf::HALF, false);
    return {name, "in.json", true, soundScenes(), beside, {"VOLUME", "--scene", "FILE", "--sweeps", "1"}};
  }
  throw std::invalid_argument("no kind of file " + name + "; there are vdb, obj, gltf, glb, exr and json");
}

}  // namespace vdb_diffuse
