#include "grid/volume_cut.h"

#include <cmath>
#include <map>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

constexpr double kVoxels = 1e-3;       // of a voxel may two places differ that are meant to be one
constexpr double kFarthest = 1 << 29;  // voxels; coordinates stay far from an int's end

/// Values of a volume on the voxels of another topology, moved by `offset` voxels.
double valueAt(const Volume& volume, const Coord& p_index) {
  return volume.values.at(*volume.topology, p_index);
}

/// Whole voxels from the origin of `a` to that of `b`.
Coord offsetBetween(const Volume& a, const Volume& b) {
  const Vec3d start = a.transform.toIndex(b.transform.toWorld(Vec3d(0)));
  Vec3d whole;
  for (int i = 0; i < 3; ++i) whole[i] = std::round(start[i]);
  const Coord corner[2] = {b.topology->lowest(), b.topology->highest()};
  for (int n = 0; n < 8; ++n) {
    const Vec3d p(corner[n >> 2][0], corner[(n >> 1) & 1][1], corner[n & 1][2]);
    const Vec3d offset = a.transform.toIndex(b.transform.toWorld(p)) - p;
    const Vec3d stray = offset - whole;
    // As a share of a voxel at the corner: what size or rotation differ grows with the distance.
    for (int i = 0; i < 3; ++i)
      if (!(std::abs(stray[i]) < kVoxels))
        throw InputError(
            "its voxels do not lie on those of the first volume: size and rotation must be the same, and the "
            "distance whole voxels; resample it");
    for (int i = 0; i < 3; ++i)
      if (!(std::abs(p[i] + whole[i]) < kFarthest))
        throw InputError("it lies too many voxels away from the first volume; move it nearer");
  }
  return Coord(static_cast<int>(whole[0]), static_cast<int>(whole[1]), static_cast<int>(whole[2]));
}

Topology unionOf(const Topology& a, const Topology& b, const Coord& offset) {
  std::map<Coord, BlockMask> masks;
  for (size_t n = 0; n < a.blockCount(); ++n) masks[a.origin(n)] = a.active(n);
  const bool aligned = blockOriginOf(offset) == offset;
  for (size_t n = 0; n < b.blockCount(); ++n) {
    if (aligned) {
      masks[b.origin(n) + offset] |= b.active(n);
      continue;
    }
    for (auto it = b.active(n).beginOn(); it; ++it) {
      const Coord p = b.origin(n) + voxelLocal(static_cast<int>(it.pos())) + offset;
      masks[blockOriginOf(p)].setOn(voxelOffset(p[0] & 7, p[1] & 7, p[2] & 7));
    }
  }
  std::vector<Coord> origins;
  std::vector<BlockMask> active;
  for (const auto& [origin, mask] : masks) {
    origins.push_back(origin);
    active.push_back(mask);
  }
  return Topology(std::move(origins), std::move(active));
}

/// The same place with another set of voxels; value(p) for each.
template <typename Value>
Volume refilled(const Volume& volume, Topology topology, const Value& value) {
  Volume result{volume.name, std::make_shared<const Topology>(std::move(topology)), volume.transform, {}};
  const Topology& t = *result.topology;
  result.values = Field<float>(t);
  forEachBlock(t.blockCount(), [&](size_t b) {
    for (auto it = t.active(b).beginOn(); it; ++it) {
      const Coord p = t.origin(b) + voxelLocal(static_cast<int>(it.pos()));
      result.values.block(b)[it.pos()] = static_cast<float>(value(p));
    }
  });
  return result;
}

}  // namespace

Volume cut(Volume volume, const VolumeCut& how) {
  if (!how.any()) return volume;
  const Topology& before = *volume.topology;
  std::vector<Coord> origins(before.blockCount());
  std::vector<BlockMask> masks(before.blockCount());
  forEachBlock(before.blockCount(), [&](size_t b) {
    origins[b] = before.origin(b);
    for (auto it = before.active(b).beginOn(); it; ++it) {
      const Coord p = before.origin(b) + voxelLocal(static_cast<int>(it.pos()));
      const bool inside = !how.crop || how.crop->holds(volume.transform.toWorld(p.asVec3d()));
      if (inside && volume.values.block(b)[it.pos()] >= how.least) masks[b].setOn(it.pos());
    }
  });
  return refilled(volume, Topology(std::move(origins), std::move(masks)),
                  [&](const Coord& p) { return valueAt(volume, p); });
}

Volume sum(Volume a, const Volume& b) {
  if (b.topology->blockCount() == 0) return a;
  const Coord offset = offsetBetween(a, b);
  return refilled(a, unionOf(*a.topology, *b.topology, offset),
                  [&](const Coord& p) { return valueAt(a, p) + valueAt(b, p - offset); });
}

}  // namespace vdb_diffuse
