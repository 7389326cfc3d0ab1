#include "scene/repeated_triangles.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cstring>

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
  uint32_t triangle;
  bool operator<(const Hashed& o) const { return hash != o.hash ? hash < o.hash : triangle < o.triangle; }
};

}  // namespace

void dropRepeatedTriangles(Mesh& mesh) {
  std::vector<Hashed> hashed(mesh.triangles.size());
  tbb::parallel_for(size_t(0), hashed.size(), [&](size_t t) {
    hashed[t] = {hashOf(cornersOf(mesh, t)), static_cast<uint32_t>(t)};
  });
  tbb::parallel_sort(hashed.begin(), hashed.end());

  std::vector<bool> repeated(mesh.triangles.size());
  for (size_t n = 0; n < hashed.size();) {
    const size_t first = n;
    while (++n < hashed.size() && hashed[n].hash == hashed[first].hash)
      repeated[hashed[n].triangle] =
          cornersOf(mesh, hashed[n].triangle) == cornersOf(mesh, hashed[first].triangle);
  }
  size_t kept = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!repeated[t]) mesh.triangles[kept++] = mesh.triangles[t];
  mesh.triangles.resize(kept);
}

}  // namespace vdb_diffuse
