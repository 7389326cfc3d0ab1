#include "grid/convert.h"

#include <atomic>
#include <cmath>
#include <functional>
#include <utility>

#include "grid/error.h"
#include "grid/tree_values.h"

namespace vdb_diffuse {
namespace {

using openvdb::GridBase;

constexpr int32_t kFarthestVoxel = 1 << 30;  // leaves room for neighbours and sums of two in 32 bits

// What Topology keeps for a block, and holds twice or for a moment while it sorts them; a table entry may
// serve up to 64 blocks' places.
constexpr uint64_t kTopologyBytesPerBlock = 2 * (sizeof(Coord) + sizeof(BlockMask)) + 6 * 4 + 4 + 64 * 4;

std::string called(const GridBase& grid) {
  return "grid " + grid.getName() + ": ";
}

std::string at(const Coord& p) {
  return "(" + std::to_string(p[0]) + "," + std::to_string(p[1]) + "," + std::to_string(p[2]) + ")";
}

std::string megabytes(double bytes) {
  char text[40];
  std::snprintf(text, sizeof text, "%.4g MB", bytes / 1e6);
  return text;
}

void requireNearVoxels(const GridBase& grid) {
  openvdb::CoordBBox box;
  if (!grid.constBaseTree().evalActiveVoxelBoundingBox(box)) return;
  for (int a = 0; a < 3; ++a)
    if (box.min()[a] < -kFarthestVoxel || box.max()[a] > kFarthestVoxel)
      throw InputError(called(grid) + "its active voxels span " + at(box.min()) + " to " + at(box.max()) +
                       ", beyond +-2^30; clip it, or move it nearer to the origin");
}

template <typename Tree>
void requireMemory(const GridBase& grid, const Tree& tree, uint64_t max_bytes) {
  uint64_t blocks = tree.leafCount(), tiles = 0;
  forEachActiveTile(tree, [&](const auto&, const Coord&, uint64_t width) {
    ++tiles;
    blocks += (width / 8) * (width / 8) * (width / 8);
  });
  const uint64_t per_block =
      componentCount<typename Tree::ValueType>() * kBlockVoxels * sizeof(float) + kTopologyBytesPerBlock;
  const double bytes = static_cast<double>(blocks) * static_cast<double>(per_block);
  if (bytes <= static_cast<double>(max_bytes) && blocks < (uint64_t(1) << 31)) return;
  throw InputError(called(grid) + std::to_string(tree.activeVoxelCount()) + " active voxels (" +
                   std::to_string(tree.leafCount()) + " leaves, " + std::to_string(tiles) +
                   " active tiles) would take " + megabytes(bytes) + ", with " +
                   megabytes(static_cast<double>(max_bytes)) + " to spare; clip or resample it");
}

template <typename Tree>
void freeze(const GridBase& grid, const Tree& tree, uint64_t max_bytes, GridValues& result) {
  constexpr int kComponents = componentCount<typename Tree::ValueType>();
  using Leaf = typename Tree::LeafNodeType;
  requireMemory(grid, tree, max_bytes);

  std::vector<const Leaf*> leaves;
  tree.getNodes(leaves);
  std::vector<Coord> origins(leaves.size());
  std::vector<BlockMask> active(leaves.size());
  forEachBlock(leaves.size(), [&](size_t l) {
    origins[l] = leaves[l]->origin();
    active[l] = leaves[l]->valueMask();
  });
  BlockMask full;
  full.setOn();
  forEachActiveTile(tree, [&](const auto&, const Coord& corner, uint64_t width) {
    const int w = static_cast<int>(width);
    for (int x = 0; x < w; x += kBlockWidth)
      for (int y = 0; y < w; y += kBlockWidth)
        for (int z = 0; z < w; z += kBlockWidth) origins.push_back(corner.offsetBy(x, y, z));
  });
  active.resize(origins.size(), full);
  result.topology = std::make_shared<const Topology>(std::move(origins), std::move(active));

  const Topology& topology = *result.topology;
  for (int c = 0; c < kComponents; ++c) {
    result.channels.emplace_back(topology);
    result.background[c] = static_cast<float>(component(tree.background(), c));
  }
  forEachBlock(topology.blockCount(), [&](size_t b) {
    const Leaf* leaf = tree.probeConstLeaf(topology.origin(b));
    if (leaf) {
      for (auto value = leaf->cbeginValueOn(); value; ++value)
        for (int c = 0; c < kComponents; ++c)
          result.channels[c].block(b)[value.pos()] = static_cast<float>(component(*value, c));
    } else {
      const auto& value = tree.getValue(topology.origin(b));
      for (int c = 0; c < kComponents; ++c)
        std::fill_n(result.channels[c].block(b), kBlockVoxels, static_cast<float>(component(value, c)));
    }
  });
}

/// What lies outside a grid's active voxels, to a place between them; what lies far outside is zero, or the
/// background.
enum class Outside { kZero, kUnknown, kBackground };

/// Told of the places that a grid has nothing for; may be empty.
using Missed = std::function<void(size_t block, int voxel)>;

/// Fields that hold in active voxels what is far outside.
template <typename Grid>
void fillWithOutside(const Grid& grid, const Topology& topology, Outside outside, Channels& result) {
  using Value = typename Grid::ValueType;
  for (int c = 0; c < componentCount<Value>(); ++c)
    result.emplace_back(topology, outside == Outside::kBackground
                                      ? static_cast<float>(component(grid.background(), c))
                                      : 0.0f);
}

/// What the grid holds at the active voxels of the same place, one field per component.
template <typename Grid>
void copy(const Grid& grid, const Topology& topology, Outside outside, const Missed& missed,
          Channels& result) {
  using Value = typename Grid::ValueType;
  fillWithOutside(grid, topology, outside, result);
  forEachBlock(topology.blockCount(), [&](size_t b) {
    auto accessor = grid.getConstAccessor();
    for (auto voxel = topology.active(b).beginOn(); voxel; ++voxel) {
      Value value;
      if (!accessor.probeValue(topology.origin(b) + voxelLocal(voxel.pos()), value)) {
        if (missed) missed(b, static_cast<int>(voxel.pos()));
        continue;
      }
      for (int c = 0; c < componentCount<Value>(); ++c)
        result[c].block(b)[voxel.pos()] = static_cast<float>(component(value, c));
    }
  });
}

template <typename Grid>
void sample(const Grid& grid, const Transform& transform, const Volume& target, Outside outside,
            const Missed& missed, Channels& result) {
  using Value = typename Grid::ValueType;
  constexpr int kComponents = componentCount<Value>();
  const Topology& topology = *target.topology;
  fillWithOutside(grid, topology, outside, result);
  forEachBlock(topology.blockCount(), [&](size_t b) {
    auto accessor = grid.getConstAccessor();
    for (auto voxel = topology.active(b).beginOn(); voxel; ++voxel) {
      const Coord p = topology.origin(b) + voxelLocal(voxel.pos());
      const Vec3d q = transform.toIndex(target.transform.toWorld(p.asVec3d()));
      // Beyond the range of coordinates there is nothing to read, and no integer to round to.
      if (!(std::abs(q[0]) < kFarthestVoxel && std::abs(q[1]) < kFarthestVoxel &&
            std::abs(q[2]) < kFarthestVoxel)) {
        if (missed) missed(b, static_cast<int>(voxel.pos()));
        continue;
      }
      const Coord corner = Coord::floor(q);
      const Vec3d f = q - corner.asVec3d();
      double sum[kComponents] = {}, weights = 0;
      for (int n = 0; n < 8; ++n) {
        const int x = n >> 2, y = (n >> 1) & 1, z = n & 1;
        const double weight = (x ? f[0] : 1 - f[0]) * (y ? f[1] : 1 - f[1]) * (z ? f[2] : 1 - f[2]);
        Value value;
        if (!(weight > 0) || !accessor.probeValue(corner.offsetBy(x, y, z), value)) continue;
        weights += weight;
        for (int c = 0; c < kComponents; ++c) sum[c] += weight * component(value, c);
      }
      if (outside == Outside::kZero) weights = 1;
      if (!(weights > 0) && missed) missed(b, static_cast<int>(voxel.pos()));
      for (int c = 0; c < kComponents && weights > 0; ++c)
        result[c].block(b)[voxel.pos()] = static_cast<float>(sum[c] / weights);
    }
  });
}

template <typename Grid, typename MakeValue>
typename Grid::Ptr build(const Topology& topology, const MakeValue& valueAt) {
  using Leaf = typename Grid::TreeType::LeafNodeType;
  std::vector<std::unique_ptr<Leaf>> leaves(topology.blockCount());
  forEachBlock(topology.blockCount(), [&](size_t b) {
    leaves[b] = std::make_unique<Leaf>(topology.origin(b));
    auto* values = leaves[b]->buffer().data();
    for (auto voxel = topology.active(b).beginOn(); voxel; ++voxel)
      values[voxel.pos()] = valueAt(b, voxel.pos());
    leaves[b]->setValueMask(topology.active(b));
  });
  auto grid = Grid::create();
  for (auto& leaf : leaves) grid->tree().addLeaf(leaf.release());
  return grid;
}

}  // namespace

GridValues valuesOf(const GridBase& grid, uint64_t max_bytes) {
  GridValues result;
  result.transform = transformOf(grid);
  requireNearVoxels(grid);
  const bool known =
      grid.apply<ValueGrids>([&](const auto& typed) { freeze(grid, typed.tree(), max_bytes, result); });
  if (!known) throw InputError(called(grid) + "holds " + grid.valueType() + ", not float or vec3s");
  return result;
}

/// Light that crosses longer voxels is no matter of one value for each, and solvers fail on them one by one.
constexpr int kMostElongated = 1000;

Transform transformOf(const GridBase& grid) {
  const openvdb::math::MapBase& map = *grid.constTransform().baseMap();
  if (!map.isLinear())
    throw InputError(called(grid) + "has a perspective (frustum) transform; resample it to a linear one");
  // The map's own application: building its matrix would refuse voxels that are merely small.
  const Vec3d axis[3] = {map.applyJacobian(Vec3d(1, 0, 0)), map.applyJacobian(Vec3d(0, 1, 0)),
                         map.applyJacobian(Vec3d(0, 0, 1))};
  const Vec3d origin = map.applyMap(Vec3d(0, 0, 0));
  constexpr double kSheared = 1e-5;  // cosine between axes: rotations stored as float stay below 1e-6
  for (int a = 0; a < 3; ++a) {
    const double size = axis[a].length();
    if (!std::isfinite(size) || !std::isfinite(origin[a]))
      throw InputError(called(grid) + "its transform is not finite");
    if (!std::isnormal(size * size))
      throw InputError(called(grid) + "its transform is singular: voxels of no size");
  }
  for (int a = 0; a < 3; ++a) {
    const Vec3d u = axis[a] / axis[a].length(), v = axis[(a + 1) % 3] / axis[(a + 1) % 3].length();
    const double cosine = u.dot(v);
    if (std::abs(cosine) > 1 - kSheared)
      throw InputError(called(grid) + "its transform is singular: two axes agree");
    if (std::abs(cosine) > kSheared)
      throw InputError(called(grid) + "its transform is sheared (axes not at right angles); resample it");
  }
  const double size[3] = {axis[0].length(), axis[1].length(), axis[2].length()};
  const double longest = std::max({size[0], size[1], size[2]}),
               shortest = std::min({size[0], size[1], size[2]});
  if (longest > kMostElongated * shortest) {
    char ratio[40];
    std::snprintf(ratio, sizeof ratio, "%.4g", longest / shortest);
    throw InputError(called(grid) + "its voxels are " + ratio + " times as long as wide, and " +
                     std::to_string(kMostElongated) + " is the most; resample it");
  }
  return Transform(axis[0], axis[1], axis[2], origin);
}

bool sameVoxels(const Transform& a, const Transform& b, const Topology& where) {
  constexpr double kVoxels = 1e-3;
  if (where.blockCount() == 0) return true;
  const Coord corner[2] = {where.lowest(), where.highest()};
  for (int n = 0; n < 8; ++n) {
    const Vec3d p(corner[n >> 2][0], corner[(n >> 1) & 1][1], corner[n & 1][2]);
    const Vec3d offset = b.toIndex(a.toWorld(p)) - p;
    if (!(std::abs(offset[0]) < kVoxels && std::abs(offset[1]) < kVoxels && std::abs(offset[2]) < kVoxels))
      return false;
  }
  return true;
}

namespace {

/// A copy, or samples where the voxels are others'.
Channels valuesOnto(const GridBase& grid, const Volume& target, Outside outside, const Missed& missed = {}) {
  const Transform transform = transformOf(grid);
  requireNearVoxels(grid);
  const bool same = sameVoxels(transform, target.transform, *target.topology);
  Channels result;
  const bool known = grid.apply<ValueGrids>([&](const auto& typed) {
    if (same)
      copy(typed, *target.topology, outside, missed, result);
    else
      sample(typed, transform, target, outside, missed, result);
  });
  if (!known) throw InputError(called(grid) + "holds " + grid.valueType() + ", not float or vec3s");
  return result;
}

}  // namespace

Field<float> sampleOnto(const GridBase& grid, const Volume& target) {
  if (!grid.isType<openvdb::FloatGrid>() && !grid.isType<openvdb::DoubleGrid>())
    throw InputError(called(grid) + "holds " + grid.valueType() + ", not float");
  return std::move(valuesOnto(grid, target, Outside::kZero).front());
}

Channels interpolateOnto(const GridBase& grid, const Volume& target) {
  return valuesOnto(grid, target, Outside::kUnknown);
}

FilledValues fillOnto(const GridBase& grid, const Volume& target) {
  FilledValues filled;
  std::atomic<uint64_t> outside{0};
  filled.channels = valuesOnto(grid, target, Outside::kBackground,
                               [&](size_t b, int n) { outside += target.values.block(b)[n] > 0; });
  filled.outside = outside;
  grid.apply<ValueGrids>([&](const auto& typed) {
    using Value = typename std::decay_t<decltype(typed)>::ValueType;
    for (int c = 0; c < componentCount<Value>(); ++c)
      filled.background[c] = static_cast<float>(component(typed.background(), c));
  });
  return filled;
}

std::shared_ptr<GridBase> gridOf(const Topology& topology, const Channels& channels,
                                 const Transform& transform) {
  GridBase::Ptr grid;
  if (channels.size() == 1) {
    grid = build<openvdb::FloatGrid>(topology, [&](size_t b, int n) { return channels[0].block(b)[n]; });
  } else {
    grid = build<openvdb::Vec3SGrid>(topology, [&](size_t b, int n) {
      return openvdb::Vec3f(channels[0].block(b)[n], channels[1].block(b)[n], channels[2].block(b)[n]);
    });
  }
  grid->setTransform(openvdbTransform(transform));
  return grid;
}

std::shared_ptr<openvdb::math::Transform> openvdbTransform(const Transform& transform) {
  openvdb::Mat4d matrix = openvdb::Mat4d::identity();  // rows are the images of the axes: OpenVDB writes p M
  for (int a = 0; a < 3; ++a) {
    for (int k = 0; k < 3; ++k) matrix(a, k) = transform.axis(a)[k];
    matrix(3, a) = transform.origin()[a];
  }
  // The plainest map that says the same: many readers know only scale and translation.
  const auto affine = std::make_shared<openvdb::math::AffineMap>(matrix);
  return std::make_shared<openvdb::math::Transform>(openvdb::math::simplify(affine));
}

}  // namespace vdb_diffuse
