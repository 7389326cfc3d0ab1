#include "surfaces/surface_cells.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "grid/parallel.h"
#include "surfaces/polygon.h"

namespace vdb_diffuse {
namespace {

/// Size of a cube, as a part of its distance from the volume. The directions of a sweep lie some 0.4 apart,
/// and what they draw on a surface far away are spots: three cells are as wide as the gaps between these.
constexpr double kCellOfDistance = 0.2;
/// The tree hangs off the grid by a fraction of a voxel that is no fraction of small numbers: a ground on
/// voxel faces would else lie between two cubes, and rounding would say in which.
constexpr double kOffGrid = 0.2360679775;
constexpr double kLeastArea = 1.0 / 16;  ///< of a cell, of its cube's face: a smaller one reflects less

/// The cube's neighbours and it itself.
template <typename Body>
void forEachAround(const CellKey& key, const Body& body) {
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j)
      for (int k = -1; k <= 1; ++k) {
        CellKey next = key;
        next.i += i;
        next.j += j;
        next.k += k;
        body(next);
      }
}

}  // namespace

bool CellKey::operator<(const CellKey& o) const {
  return std::tie(surface, side, level, i, j, k) < std::tie(o.surface, o.side, o.level, o.i, o.j, o.k);
}

size_t CellHash::operator()(const CellKey& key) const {
  uint64_t h = 0x9E3779B97F4A7C15ull;
  for (uint64_t part : {uint64_t(uint32_t(key.surface)) << 16 | uint64_t(key.side) << 8 | uint64_t(key.level),
                        uint64_t(uint32_t(key.i)) << 32 | uint32_t(key.j), uint64_t(uint32_t(key.k))}) {
    h = (h ^ part) * 0xBF58476D1CE4E5B9ull;
    h ^= h >> 31;
  }
  return static_cast<size_t>(h);
}

CellTree::CellTree(const Topology& topology, const Transform& transform, const std::vector<Surface>& surfaces,
                   int finest_level)
    : transform_(transform), surfaces_(surfaces), finest_level_(finest_level) {
  const Vec3d low = topology.lowest().asVec3d() - Vec3d(0.5),
              high = topology.highest().asVec3d() + Vec3d(0.5);
  anchor_ = 0.5 * (low + high) + Vec3d(kOffGrid);
  low_ = low - anchor_;
  high_ = high - anchor_;
}

Vec3d CellTree::corner(int surface, uint32_t triangle, int n) const {
  const Mesh& mesh = surfaces_[surface].mesh;
  return transform_.toIndex(mesh.positions[mesh.triangles[triangle][n]]) - anchor_;
}

int CellTree::sideOf(int surface, uint32_t triangle, bool front) const {
  const Mesh& mesh = surfaces_[surface].mesh;
  const auto& t = mesh.triangles[triangle];
  const Vec3d normal =
      (mesh.positions[t[1]] - mesh.positions[t[0]]).cross(mesh.positions[t[2]] - mesh.positions[t[0]]);
  Vec3d n;
  for (int a = 0; a < 3; ++a) n[a] = normal.dot(transform_.axis(a)) / transform_.axis(a).length();
  int axis = 0;
  for (int a = 1; a < 3; ++a)
    if (std::abs(n[a]) > std::abs(n[axis]) * (1 + 1e-6)) axis = a;
  return 2 * axis + ((n[axis] > 0) == front ? 1 : 0);
}

bool CellTree::fits(const CellKey& key) const {
  const double width = std::ldexp(1.0, key.level);
  const int32_t place[3] = {key.i, key.j, key.k};
  double distance = 0;
  for (int a = 0; a < 3; ++a)
    distance = std::max({distance, low_[a] - (place[a] + 1.0) * width, place[a] * width - high_[a]});
  return key.level <= finest_level_ || width <= kCellOfDistance * distance;
}

bool CellTree::isLeaf(const CellKey& key) const {
  CellKey parent = key;
  ++parent.level;
  parent.i >>= 1;
  parent.j >>= 1;
  parent.k >>= 1;
  return fits(key) && !fits(parent);
}

CellKey CellTree::keyOf(int surface, uint32_t triangle, bool front, const Vec3d& p_index) const {
  const Vec3d p = p_index - anchor_;
  double outside = 0;
  for (int a = 0; a < 3; ++a) outside = std::max({outside, low_[a] - p[a], p[a] - high_[a]});
  CellKey key{surface, static_cast<int8_t>(sideOf(surface, triangle, front)), 0, 0, 0, 0};
  // From the largest cube that may do downward: a cube is cut while it is too wide for its own distance.
  const double finest = std::ldexp(1.0, finest_level_);
  for (int level = std::ilogb(std::max(finest, kCellOfDistance * outside));; --level) {
    const double width = std::ldexp(1.0, level);
    const auto place = [&](int a) {
      return static_cast<int32_t>(std::clamp(std::floor(p[a] / width), -2e9, 2e9));
    };
    key.level = static_cast<int8_t>(level);
    key.i = place(0);
    key.j = place(1);
    key.k = place(2);
    if (fits(key)) return key;
  }
}

void CellTree::range(int level, int surface, uint32_t triangle, double low[3], double high[3]) const {
  const Vec3d p[3] = {corner(surface, triangle, 0), corner(surface, triangle, 1),
                      corner(surface, triangle, 2)};
  const double width = std::ldexp(1.0, level);
  for (int a = 0; a < 3; ++a) {
    low[a] = std::floor(std::min({p[0][a], p[1][a], p[2][a]}) / width);
    high[a] = std::floor(std::max({p[0][a], p[1][a], p[2][a]}) / width);
  }
}

double CellTree::areaIn(const CellKey& cell, int surface, uint32_t triangle) const {
  std::vector<Vec3d> polygon;
  for (int n = 0; n < 3; ++n) polygon.push_back(corner(surface, triangle, n));
  const double width = std::ldexp(1.0, cell.level);
  const int32_t place[3] = {cell.i, cell.j, cell.k};
  for (int a = 0; a < 3; ++a) {
    clip(polygon, a, place[a] * width, 1);
    clip(polygon, a, (place[a] + 1.0) * width, -1);
  }
  double area = 0;
  for (size_t n = 2; n < polygon.size(); ++n)
    area += 0.5 * transform_.directionToWorld(polygon[n - 1] - polygon[0])
                      .cross(transform_.directionToWorld(polygon[n] - polygon[0]))
                      .length();
  return area;
}

namespace {

using CellIndex = std::unordered_map<CellKey, uint32_t, CellHash>;

/// What add(begin, end, list) puts into lists for parts of 0..count, one list after the other; all threads.
template <typename Item, typename Add>
std::vector<Item> listed(size_t count, const Add& add) {
  constexpr size_t kPart = 1024;
  std::vector<std::vector<Item>> parts((count + kPart - 1) / kPart);
  forEachBlock(
      parts.size(), [&](size_t p) { add(p * kPart, std::min(count, (p + 1) * kPart), parts[p]); }, 1);
  std::vector<Item> list;
  for (std::vector<Item>& part : parts) {
    list.insert(list.end(), part.begin(), part.end());
    part = {};
  }
  return list;
}

/// The cells met, by their numbers, and after them their neighbours.
CellIndex withNeighbours(const CellTree& tree, const std::vector<CellKey>& met) {
  CellIndex index;
  index.reserve(2 * met.size());
  for (const CellKey& key : met) index.emplace(key, static_cast<uint32_t>(index.size()));
  const auto addUnmet = [&](size_t begin, size_t end, std::vector<CellKey>& list) {
    for (size_t n = begin; n < end; ++n)
      forEachAround(met[n], [&](const CellKey& next) {
        if (index.find(next) == index.end() && tree.isLeaf(next)) list.push_back(next);
      });
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  };
  for (const CellKey& key : listed<CellKey>(met.size(), addUnmet))
    index.emplace(key, static_cast<uint32_t>(index.size()));
  return index;
}

/// World areas of the surface in each cell.
std::vector<double> areasOf(const CellTree& tree, const CellIndex& index) {
  std::map<std::pair<int32_t, int>, std::vector<CellKey>> levels;  // cells by surface and level
  for (const auto& [key, n] : index) levels[{key.surface, key.level}].push_back(key);
  struct Part {
    uint32_t cell;
    double area;
  };
  std::vector<double> area(index.size(), 0.0);
  for (const auto& of : levels) {
    const int32_t surface = of.first.first;
    const int level = of.first.second;
    const std::vector<CellKey>& list = of.second;
    const auto addTriangle = [&](uint32_t t, std::vector<Part>& parts) {
      const int sides[2] = {tree.sideOf(surface, t, false), tree.sideOf(surface, t, true)};
      double low[3], high[3];
      tree.range(level, surface, t, low, high);
      const auto add = [&](const CellKey& key) {
        const auto found = index.find(key);
        if (found != index.end()) parts.push_back({found->second, tree.areaIn(key, surface, t)});
      };
      const double cubes = (high[0] - low[0] + 1) * (high[1] - low[1] + 1) * (high[2] - low[2] + 1);
      if (cubes > static_cast<double>(list.size())) {
        for (const CellKey& key : list) {
          const double place[3] = {double(key.i), double(key.j), double(key.k)};
          bool meets = key.side == sides[0] || key.side == sides[1];
          for (int a = 0; a < 3; ++a) meets = meets && place[a] >= low[a] && place[a] <= high[a];
          if (meets) add(key);
        }
        return;
      }
      for (double i = low[0]; i <= high[0]; ++i)
        for (double j = low[1]; j <= high[1]; ++j)
          for (double k = low[2]; k <= high[2]; ++k)
            for (int side : sides)
              add({surface, static_cast<int8_t>(side), static_cast<int8_t>(level), int32_t(i), int32_t(j),
                   int32_t(k)});
    };
    const auto addTriangles = [&](size_t begin, size_t end, std::vector<Part>& parts) {
      for (size_t t = begin; t < end; ++t) addTriangle(static_cast<uint32_t>(t), parts);
    };
    for (const Part& part : listed<Part>(tree.surfaces()[surface].mesh.triangles.size(), addTriangles))
      area[part.cell] += part.area;
  }
  return area;
}

}  // namespace

SurfaceCells makeSurfaceCells(const CellTree& tree, std::vector<CellKey> met) {
  SurfaceCells cells;
  cells.keys = std::move(met);
  const CellIndex index = withNeighbours(tree, cells.keys);
  const std::vector<double> own = areasOf(tree, index);
  const double unit = tree.meanVoxelSize() * tree.meanVoxelSize();
  const size_t met_count = cells.keys.size();
  cells.area.resize(met_count);
  cells.first.assign(met_count + 1, 0);
  cells.around = listed<uint32_t>(met_count, [&](size_t begin, size_t end, std::vector<uint32_t>& around) {
    for (size_t n = begin; n < end; ++n) {
      const size_t before = around.size();
      const CellKey& key = cells.keys[n];
      double area = 0;
      forEachAround(key, [&](const CellKey& next) {
        const auto found = index.find(next);
        if (found == index.end()) return;
        area += own[found->second] / unit;
        if (found->second < met_count) around.push_back(found->second);
      });
      cells.area[n] = static_cast<float>(std::max(area, kLeastArea * std::ldexp(1.0, 2 * key.level)));
      cells.first[n + 1] = static_cast<uint32_t>(around.size() - before);
    }
  });
  std::partial_sum(cells.first.begin(), cells.first.end(), cells.first.begin());
  return cells;
}

}  // namespace vdb_diffuse
