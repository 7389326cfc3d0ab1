#include "io/mesh_file.h"

#include "grid/error.h"
#include "io/mesh_import.h"

namespace vdb_diffuse {

Mesh readMesh(const std::string& path, Up up) {
  Mesh mesh;
  for (const ImportedMesh& part : importMeshes(path, up).meshes) {
    const auto offset = static_cast<uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), part.mesh.positions.begin(), part.mesh.positions.end());
    for (auto triangle : part.mesh.triangles) {
      for (uint32_t& corner : triangle) corner += offset;
      mesh.triangles.push_back(triangle);
    }
  }
  if (mesh.triangles.empty()) throw InputError(path + ": has no triangles");
  return mesh;
}

}  // namespace vdb_diffuse
