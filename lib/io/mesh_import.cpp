#include "io/mesh_import.h"

#include <assimp/GltfMaterial.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/BaseImporter.h>
#include <assimp/DefaultIOSystem.h>
#include <assimp/MemoryIOWrapper.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>
#include <new>

#include "grid/error.h"
#include "io/gltf_json.h"
#include "io/json_file.h"
#include "io/plain_gltf.h"
#include "io/plain_obj.h"

namespace vdb_diffuse {
namespace {

/// Gives assimp a file made plain in the place of the one at its path, and else lets it open regular files
/// only, the buffers of a glTF file, and not more than kLargestMeshFile bytes of them in all.
class FencedFiles : public Assimp::DefaultIOSystem {
 public:
  FencedFiles(std::string path, const std::string& plain)
      : path_(std::move(path)), plain_(plain), opened_(std::min(plain.size(), size_t{kLargestMeshFile})) {}

  bool Exists(
      const char* path) const override {  // the usual one opens the file, and a pipe waits for a writer
    std::error_code error;
    return path_ == path || std::filesystem::is_regular_file(path, error);
  }
  Assimp::IOStream* Open(const char* path, const char* mode) override {
    std::error_code error;
    if (std::strchr(mode, 'w') || !Exists(path)) return nullptr;
    if (path_ == path)
      return new Assimp::MemoryIOStream(reinterpret_cast<const uint8_t*>(plain_.data()), plain_.size());
    const uintmax_t size = std::filesystem::file_size(path, error);
    if (error || size > kLargestMeshFile - opened_) return nullptr;
    opened_ += size;
    return DefaultIOSystem::Open(path, mode);
  }

 private:
  const std::string path_;
  const std::string& plain_;
  uintmax_t opened_;
};

const aiScene* load(Assimp::Importer& importer, const std::string& path, const std::string& extension,
                    const std::string& plain) {
  // Only the reader of this format stays: the others' signatures must not decide what a file is.
  const std::string wanted = extension == ".obj" ? "Wavefront Object Importer" : "glTF2 Importer";
  for (size_t i = importer.GetImporterCount(); i-- > 0;) {
    if (importer.GetImporterInfo(i)->mName == wanted) continue;
    // What is unregistered is not deleted.
    std::unique_ptr<Assimp::BaseImporter> ours(importer.GetImporter(i));
    importer.UnregisterLoader(ours.get());
  }
  if (importer.GetImporterCount() != 1) throw std::logic_error("assimp lacks the " + wanted);
  importer.SetIOHandler(new FencedFiles(path, plain));  // owned by the importer
  const aiScene* scene = nullptr;
  try {
    scene = importer.ReadFile(path, 0);
    if (scene && scene->mNumMeshes > 0) scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
  } catch (const InputError&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw InputError(path + ": refused, it asks for more memory than there is");
  } catch (const std::exception& e) {
    throw InputError(path + ": damaged: " + printable(e.what()));
  }
  if (!scene || !scene->mRootNode)  // a file of lights alone is "incomplete" to assimp, and welcome
    throw InputError(path + ": not a mesh that can be read: " + printable(importer.GetErrorString()));
  return scene;
}

struct Placed {
  const aiNode* node;
  aiMatrix4x4t<double> to_world;
  int depth;
};

aiMatrix4x4t<double> inDouble(const aiMatrix4x4& m) {
  return aiMatrix4x4t<double>(m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, m.d1,
                              m.d2, m.d3, m.d4);
}

/// visit(mesh index, transform, node) for every mesh of every node, each node once, parents first.
template <typename Visit>
void forEachPlacedMesh(const aiScene& scene, const std::string& path, const Visit& visit) {
  std::vector<Placed> open{{scene.mRootNode, inDouble(scene.mRootNode->mTransformation), 0}};
  size_t visited = 0;
  while (!open.empty()) {
    const Placed placed = open.back();
    open.pop_back();
    if (++visited > kMostGltfNodes || placed.depth > 2 * kDeepestGltfNode)
      throw InputError(path + ": more than " + std::to_string(kMostGltfNodes) + " nodes, or too deep a tree");
    for (unsigned i = 0; i < placed.node->mNumMeshes; ++i) {
      if (placed.node->mMeshes[i] >= scene.mNumMeshes) throw InputError(path + ": damaged: no such mesh");
      visit(placed.node->mMeshes[i], placed.to_world, *placed.node);
    }
    for (unsigned i = placed.node->mNumChildren; i-- > 0;) {
      const aiNode* child = placed.node->mChildren[i];
      open.push_back({child, placed.to_world * inDouble(child->mTransformation), placed.depth + 1});
    }
  }
}

size_t triangleCount(const aiMesh& mesh) {
  size_t count = 0;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) count += mesh.mFaces[f].mNumIndices == 3;
  return count;
}

Mesh placedMesh(const aiMesh& mesh, const aiMatrix4x4t<double>& to_world, const std::string& path) {
  const auto refuse = [&](const std::string& what) {
    throw InputError(path + ": mesh '" + printable(mesh.mName.C_Str()) + "': " + what);
  };
  Mesh placed;
  placed.positions.reserve(mesh.mNumVertices);
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    const aiVector3D& v = mesh.mVertices[i];
    const aiVector3t<double> p = to_world * aiVector3t<double>(v.x, v.y, v.z);
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z) ||
        std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > 1e18)
      refuse("vertex " + std::to_string(i) + " is not finite, or beyond 1e18");
    placed.positions.emplace_back(p.x, p.y, p.z);
  }
  // A mirror turns a triangle's order round; the glTF specification keeps its front.
  const bool mirrored = aiMatrix3x3t<double>(to_world).Determinant() < 0;
  placed.triangles.reserve(triangleCount(mesh));
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (face.mNumIndices != 3) continue;  // points and lines
    for (int i = 0; i < 3; ++i)
      if (face.mIndices[i] >= mesh.mNumVertices)
        refuse("face " + std::to_string(f) + " refers to vertex " + std::to_string(face.mIndices[i]) +
               " of " + std::to_string(mesh.mNumVertices));
    placed.triangles.push_back(
        {face.mIndices[0], face.mIndices[mirrored ? 2 : 1], face.mIndices[mirrored ? 1 : 2]});
  }
  return placed;
}

ImportedMaterial materialOf(const aiMaterial& material) {
  ImportedMaterial result;
  aiString name;
  if (material.Get(AI_MATKEY_NAME, name) == AI_SUCCESS) result.name = name.C_Str();
  aiColor4D base(1, 1, 1, 1);
  if (material.Get(AI_MATKEY_BASE_COLOR, base) == AI_SUCCESS ||
      material.Get(AI_MATKEY_COLOR_DIFFUSE, base) == AI_SUCCESS)
    result.base_color = Vec3d(base.r, base.g, base.b);
  aiColor3D emissive(0, 0, 0);
  if (material.Get(AI_MATKEY_COLOR_EMISSIVE, emissive) == AI_SUCCESS)
    result.emissive = Vec3d(emissive.r, emissive.g, emissive.b);
  return result;
}

}  // namespace

ImportedFile importMeshes(const std::string& path, Up up) {
  const std::string extension = extensionOf(path);
  const bool gltf = extension == ".gltf" || extension == ".glb";
  if (!gltf && extension != ".obj")
    throw InputError(path + ": meshes are read from .obj, .gltf and .glb files");

  const std::string plain = gltf ? plainGltf(readGltfJson(path), path) : plainObj(path);
  Assimp::Importer importer;
  const aiScene* scene = load(importer, path, extension, plain);
  size_t triangles = 0, vertices = 0;
  forEachPlacedMesh(*scene, path, [&](unsigned m, const auto&, const aiNode&) {
    triangles += triangleCount(*scene->mMeshes[m]);
    vertices += scene->mMeshes[m]->mNumVertices;
    if (triangles > kMostTriangles || vertices > 3 * kMostTriangles)
      throw InputError(path + ": more than " + std::to_string(kMostTriangles) + " triangles");
  });

  ImportedFile file;
  forEachPlacedMesh(*scene, path, [&](unsigned m, const auto& to_world, const aiNode& node) {
    const aiMesh& mesh = *scene->mMeshes[m];
    if (triangleCount(mesh) == 0) return;
    ImportedMesh placed{node.mName.length ? node.mName.C_Str() : mesh.mName.C_Str(),
                        placedMesh(mesh, to_world, path), mesh.mMaterialIndex};
    if (placed.material >= scene->mNumMaterials) throw InputError(path + ": damaged: no such material");
    if (gltf)
      for (Vec3d& p : placed.mesh.positions) p = fromYUp(p, up);
    file.meshes.push_back(std::move(placed));
  });
  for (unsigned i = 0; i < scene->mNumMaterials; ++i)
    file.materials.push_back(materialOf(*scene->mMaterials[i]));
  return file;
}

}  // namespace vdb_diffuse
