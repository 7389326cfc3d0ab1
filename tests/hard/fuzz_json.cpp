// A libFuzzer target for scene files in JSON (see fuzz.sh). A mesh and a picture that they may name lie
// beside them.
#include <cmath>

#include "hard/fuzzed_file.h"
#include "io/image.h"
#include "io/scene_file.h"

namespace vdb_diffuse {
namespace {

/// Holds what is said of lights to what the rest of the program counts on.
struct ExpectSound {
  static void strength(const Vec3d& v) {
    for (int a = 0; a < 3; ++a)
      expect(v[a] >= 0 && v[a] <= kStrongestLight, "a light's strength is in range");
  }
  static void place(const Vec3d& p) {
    for (int a = 0; a < 3; ++a) expect(std::isfinite(p[a]), "a light's place is finite");
  }
  static void direction(const Vec3d& d) {
    expect(std::abs(d.length() - 1) < 1e-9, "a direction is of unit length");
  }
  void operator()(const SunLight& sun) const {
    strength(sun.irradiance);
    direction(sun.direction);
    expect(sun.angle >= 0 && sun.angle < 3.15, "a sun's angle is in range");
  }
  void operator()(const PointLight& point) const {
    strength(point.intensity);
    place(point.position);
    expect(point.radius >= 0 && std::isfinite(point.radius), "a point light's radius is in range");
  }
  void operator()(const SpotLight& spot) const {
    strength(spot.intensity);
    place(spot.position);
    direction(spot.direction);
    expect(spot.angle > 0 && spot.angle < 3.15, "a cone's angle is in range");
    expect(spot.blend >= 0 && spot.blend <= 1, "a cone's edge is in range");
  }
  void operator()(const AreaLight& area) const {
    strength(area.radiance);
    expect(!area.mesh.triangles.empty(), "an area light has triangles");
  }
  void operator()(const DomeLight& dome) const {
    strength(dome.radiance);
    expect(std::isfinite(dome.rotation), "a dome's rotation is finite");
  }
};

void readFile(const std::string& path) {
  const SceneFile file = readSceneFile(path);
  for (const NamedLight& light : file.scene.lights) std::visit(ExpectSound(), light.light);
  const Optics optics = opticsOf(file.medium);
  for (int a = 0; a < 3; ++a) {
    expect(optics.sigma_s[a] >= 0 && std::isfinite(optics.sigma_s[a]), "scattering is in range");
    expect(optics.sigma_a[a] >= 0 && std::isfinite(optics.sigma_a[a]), "absorption is in range");
  }
  expect(std::abs(optics.g) < 1, "g is in range");
}

/// With what a scene may name.
struct SceneFolder : TemporaryFolder {
  SceneFolder() {
    writeText(file("plate.obj"), "v -6 -6 -6\nv 6 -6 -6\nv 6 6 -6\nf 1 2 3\n");
    writeExr(file("sky.exr"), {4, 2, std::vector<Vec3f>(8, Vec3f(1))});
  }
};

}  // namespace
}  // namespace vdb_diffuse

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const vdb_diffuse::SceneFolder folder;
  return vdb_diffuse::readFuzzed(folder, "in.json", data, size, vdb_diffuse::readFile);
}
