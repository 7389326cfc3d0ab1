#pragma once

#include <openvdb/Types.h>

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

namespace vdb_diffuse {

using openvdb::Vec3d;
using openvdb::Vec3f;

/// Triangles in world space; counter-clockwise is the front.
struct Mesh {
  std::vector<Vec3d> positions;
  std::vector<std::array<uint32_t, 3>> triangles;  ///< indices into `positions`, in range
};

/// An RGB picture, first row on top.
struct Image {
  int width = 0, height = 0;
  std::vector<Vec3f> pixels;  ///< height x width, finite, >= 0
};

// All directions are the way the light travels, of unit length; all angles are radians.

/// Of a light: what a radiance, intensity or irradiance may be at most. Its products fit a float.
constexpr double kStrongestLight = 1e30;

struct SunLight {
  Vec3d direction{0, 0, -1};
  Vec3d irradiance{1, 1, 1};  ///< on a plane that faces the sun, W/m2
  double angle = 0;           ///< angular diameter
};

struct PointLight {
  Vec3d position{0, 0, 0};
  Vec3d intensity{1, 1, 1};  ///< W/sr
  double radius = 0;         ///< of the glowing ball, world units
};

struct SpotLight {
  Vec3d position{0, 0, 0};
  Vec3d direction{0, 0, -1};
  Vec3d intensity{1, 1, 1};  ///< along the axis, W/sr
  double angle = 0.785;      ///< full cone
  double blend = 0.15;       ///< fraction of the cone over which it fades, 0..1
};

struct AreaLight {
  Mesh mesh;                ///< shines from its front, hides nothing
  Vec3d radiance{1, 1, 1};  ///< W/m2/sr
};

struct DomeLight {
  Vec3d radiance{1, 1, 1};             ///< W/m2/sr; a factor where there is an image
  std::shared_ptr<const Image> image;  ///< equirectangular as in Cycles, z up; none: uniform
  double rotation = 0;                 ///< about z, counter-clockwise seen from above
};

using Light = std::variant<SunLight, PointLight, SpotLight, AreaLight, DomeLight>;

struct NamedLight {
  std::string name;
  Light light;
  std::string group = "";  ///< whose light is wanted apart from others'; empty: its own
};

struct Surface {
  std::string name;
  Mesh mesh;
  Vec3d albedo{0, 0, 0};  ///< Lambertian on both sides, 0..1
};

struct Scene {
  std::vector<NamedLight> lights;
  std::vector<Surface> surfaces;
};

}  // namespace vdb_diffuse
