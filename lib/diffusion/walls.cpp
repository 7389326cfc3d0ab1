#include "diffusion/walls.h"

#include <algorithm>
#include <cmath>

#include "grid/parallel.h"

namespace vdb_diffuse {
namespace {

float areaFactor(const Mesh& mesh, uint32_t triangle, const Transform& transform) {
  const auto& t = mesh.triangles[triangle];
  const Vec3d n =
      (mesh.positions[t[1]] - mesh.positions[t[0]]).cross(mesh.positions[t[2]] - mesh.positions[t[0]]);
  double one = 0;
  for (int a = 0; a < 3; ++a) one += std::abs(n.dot(transform.axis(a))) / transform.axis(a).length();
  return one > 0 ? static_cast<float>(n.length() / one) : 1.0f;
}

/// Is there anything of the surfaces' bounding box within a voxel of this block?
bool nearSurfaces(const Coord& origin, const Transform& transform, const Occluder& occluder) {
  constexpr double kHuge = 1e300;
  Vec3d low(kHuge), high(-kHuge);
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d p = transform.toWorld(
        origin.asVec3d() + Vec3d(corner & 1 ? 8.5 : -1.5, corner & 2 ? 8.5 : -1.5, corner & 4 ? 8.5 : -1.5));
    low = openvdb::math::minComponent(low, p);
    high = openvdb::math::maxComponent(high, p);
  }
  const Vec3d a = occluder.lowest(), b = occluder.highest();
  for (int i = 0; i < 3; ++i)
    if (high[i] < a[i] || low[i] > b[i]) return false;
  return true;
}

}  // namespace

Walls findWalls(const Topology& topology, const Transform& transform, const Occluder& occluder,
                const std::vector<Surface>& surfaces) {
  Walls walls;
  if (occluder.empty()) return walls;
  std::vector<std::vector<WallFace>> found(topology.blockCount());
  forEachBlock(topology.blockCount(), [&](size_t b) {
    const Coord& origin = topology.origin(b);
    if (!nearSurfaces(origin, transform, occluder)) return;
    for (int axis = 0; axis < 3; ++axis) {
      const double step = transform.axis(axis).length();
      const Vec3d along = transform.axis(axis) / step;
      for (int row = 0; row < 64; ++row) {
        Coord p = origin;
        p[(axis + 1) % 3] += row >> 3;
        p[(axis + 2) % 3] += row & 7;
        const Vec3d start = transform.toWorld(p.asVec3d());
        // One ray answers for the whole row where nothing is met, which is nearly everywhere.
        if (!occluder.hidden(start - along * step, along, 9 * step)) continue;
        for (int i = 0; i < 8; ++i) {
          Coord local = p - origin;
          local[axis] = i;
          const int voxel = voxelOffset(local[0], local[1], local[2]);
          if (!topology.active(b).isOn(voxel)) continue;
          for (int up = 0; up < 2; ++up) {
            const auto hit = occluder.closest(start + along * (i * step), up ? along : -along, step);
            if (!hit) continue;
            const float area = areaFactor(surfaces[hit->surface].mesh, hit->triangle, transform);
            found[b].push_back(
                {static_cast<uint16_t>(voxel), static_cast<uint8_t>(2 * axis + up), hit->surface, area});
          }
        }
      }
    }
    std::sort(found[b].begin(), found[b].end(), [](const WallFace& u, const WallFace& v) {
      return u.voxel != v.voxel ? u.voxel < v.voxel : u.face < v.face;
    });
  });
  for (size_t b = 0; b < found.size(); ++b)
    if (!found[b].empty()) walls.emplace(static_cast<int32_t>(b), std::move(found[b]));
  return walls;
}

const WallFace* wallAt(const Walls& walls, size_t block, int voxel, int face) {
  if (walls.empty()) return nullptr;
  const auto list = walls.find(static_cast<int32_t>(block));
  if (list == walls.end()) return nullptr;
  const auto at = std::lower_bound(list->second.begin(), list->second.end(), voxel * 6 + face,
                                   [](const WallFace& w, int key) { return w.voxel * 6 + w.face < key; });
  return at != list->second.end() && at->voxel == voxel && at->face == face ? &*at : nullptr;
}

}  // namespace vdb_diffuse
