#pragma once

#include <string>
#include <vector>

#include "io/mesh_file.h"

namespace vdb_diffuse {

/// One mesh in one place of a file's node tree, in world space.
struct ImportedMesh {
  std::string name;
  Mesh mesh;
  size_t material = 0;  ///< index into ImportedFile::materials
};

struct ImportedMaterial {
  std::string name;
  Vec3d base_color{1, 1, 1};
  Vec3d emissive{0, 0, 0};
};

struct ImportedFile {
  std::vector<ImportedMesh> meshes;
  std::vector<ImportedMaterial> materials;
};

/// The triangles of an OBJ, glTF or GLB file, read by assimp between two fences: sizes, JSON depth and the
/// node tree are checked before it, indices, finiteness and counts after. May hold no mesh at all.
/// \throws InputError naming the path
ImportedFile importMeshes(const std::string& path, Up up);

/// From glTF's axes, y up, to the VDB's.
inline Vec3d fromYUp(const Vec3d& v, Up up) {
  return up == Up::kZ ? Vec3d(v[0], -v[2], v[1]) : v;
}

}  // namespace vdb_diffuse
