// A libFuzzer target for meshes, built once per format: fuzz_obj, fuzz_gltf, fuzz_glb (see fuzz.sh). glTF is
// read as a whole scene, lights and materials too.
#include <cmath>

#include "hard/fuzzed_file.h"
#include "io/gltf_scene.h"
#include "io/mesh_file.h"

namespace vdb_diffuse {
namespace {

void expectSound(const Mesh& mesh) {
  for (const Vec3d& p : mesh.positions)
    for (int a = 0; a < 3; ++a) expect(std::abs(p[a]) <= 1e18, "positions are finite");
  for (const auto& triangle : mesh.triangles)
    for (const uint32_t corner : triangle) expect(corner < mesh.positions.size(), "indices are in range");
}

void expectSound(const Vec3d& colour, double most) {
  for (int a = 0; a < 3; ++a) expect(colour[a] >= 0 && colour[a] <= most, "colours are in range");
}

void readFile(const std::string& path) {
  if (std::string(FUZZED_NAME) == "in.obj") return expectSound(readMesh(path));
  const Scene scene = readGltfScene(path);
  for (const Surface& surface : scene.surfaces) {
    expectSound(surface.mesh);
    expectSound(surface.albedo, 1);
  }
  for (const NamedLight& light : scene.lights)
    if (const auto* area = std::get_if<AreaLight>(&light.light)) {
      expectSound(area->mesh);
      expectSound(area->radiance, kStrongestLight);
    }
}

}  // namespace
}  // namespace vdb_diffuse

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const vdb_diffuse::TemporaryFolder folder;
  return vdb_diffuse::readFuzzed(folder, FUZZED_NAME, data, size, vdb_diffuse::readFile);
}
