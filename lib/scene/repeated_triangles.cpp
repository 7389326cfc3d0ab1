#include "scene/repeated_triangles.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cstring>
#include <tuple>

namespace vdb_diffuse {
namespace {

using Corners = std::array<Vec3d, 3>;

/// The smallest corner first, in the same turn. -0 is 0.
Corners cornersOf(const Mesh& mesh, size_t triangle) {
  Corners corners;
  for (size_t n = 0; n < 3; ++n) corners[n] = mesh.positions[mesh.triangles[triangle][n]] + Vec3d(0);
  std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
  return corners;
}

uint64_t hashOf(const Corners& corners) {
  uint64_t hash = 0;
  for (const Vec3d& corner : corners)
    for (int a = 0; a < 3; ++a) {
      const double coordinate = corner[a];
      uint64_t bits;
      std::memcpy(&bits, &coordinate, sizeof bits);
      hash = (hash ^ bits) * 0x9E3779B97F4A7C15u;  // 2^64 over the golden ratio
      hash ^= hash >> 29;
    }
  return hash;
}

struct Hashed {
  uint64_t hash;
  uint32_t mesh, triangle;
  bool operator<(const Hashed& o) const {
    return std::tie(hash, mesh, triangle) < std::tie(o.hash, o.mesh, o.triangle);
  }
};

void dropRepeated(const std::vector<Mesh*>& meshes) {
  std::vector<Hashed> hashed;
  for (size_t m = 0; m < meshes.size(); ++m) {
    const Mesh& mesh = *meshes[m];
    const size_t before = hashed.size();
    hashed.resize(before + mesh.triangles.size());
    tbb::parallel_for(size_t(0), mesh.triangles.size(), [&](size_t t) {
      hashed[before + t] = {hashOf(cornersOf(mesh, t)), static_cast<uint32_t>(m), static_cast<uint32_t>(t)};
    });
  }
  tbb::parallel_sort(hashed.begin(), hashed.end());

  const auto cornersAt = [&](const Hashed& h) { return cornersOf(*meshes[h.mesh], h.triangle); };
  std::vector<std::vector<bool>> repeated(meshes.size());  // by triangle, where a mesh has any
  for (size_t n = 0; n < hashed.size();) {
    const size_t first = n;
    while (++n < hashed.size() && hashed[n].hash == hashed[first].hash) {
      if (cornersAt(hashed[n]) != cornersAt(hashed[first])) continue;
      std::vector<bool>& of_mesh = repeated[hashed[n].mesh];
      of_mesh.resize(meshes[hashed[n].mesh]->triangles.size());
      of_mesh[hashed[n].triangle] = true;
    }
  }
  for (size_t m = 0; m < meshes.size(); ++m) {
    if (repeated[m].empty()) continue;
    auto& triangles = meshes[m]->triangles;
    size_t kept = 0;
    for (size_t t = 0; t < triangles.size(); ++t)
      if (!repeated[m][t]) triangles[kept++] = triangles[t];
    triangles.resize(kept);
  }
}

}  // namespace

void dropRepeatedTriangles(Scene& scene) {
  std::vector<Mesh*> meshes;
  for (Surface& surface : scene.surfaces) meshes.push_back(&surface.mesh);
  dropRepeated(meshes);
  const auto empty = [](const Surface& surface) { return surface.mesh.triangles.empty(); };
  scene.surfaces.erase(std::remove_if(scene.surfaces.begin(), scene.surfaces.end(), empty),
                       scene.surfaces.end());
  for (NamedLight& light : scene.lights)
    if (auto* area = std::get_if<AreaLight>(&light.light)) dropRepeated({&area->mesh});
}

}  // namespace vdb_diffuse
