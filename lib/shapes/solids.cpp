#include "shapes/solids.h"

#include <algorithm>
#include <cmath>

#include "shapes/sparse_fill.h"

namespace vdb_diffuse {
namespace {

/// Densities by voxel inside a box of `side` voxels with one corner at voxel (0,0,0), centred in the world.
template <typename Value>
Volume filledBox(const Coord& side, double voxel_size, const Value& value) {
  Formula formula;
  formula.highest = side.offsetBy(-1);
  formula.fill = [&](const Coord& origin, float* values, BlockMask& active) {
    for (int n = 0; n < kBlockVoxels; ++n) {
      const Coord p = origin + voxelLocal(n);
      if (p[0] >= side[0] || p[1] >= side[1] || p[2] >= side[2]) continue;
      values[n] = static_cast<float>(value(p));
      active.setOn(n);
    }
  };
  return sparseFill(formula, voxel_size, Vec3d(side[0] - 1, side[1] - 1, side[2] - 1) * (-0.5 * voxel_size));
}

/// Sides of the box nearest to a cube, or to a square of the given height, with about so many voxels.
Coord boxSides(size_t voxels, int height = 0) {
  const double n = static_cast<double>(voxels);
  const double z = height > 0 ? height : std::max(1.0, std::round(std::cbrt(n)));
  const double x = std::max(1.0, std::round(std::sqrt(n / z))), y = std::max(1.0, std::round(n / (z * x)));
  return Coord(static_cast<int>(x), static_cast<int>(y), static_cast<int>(z));
}

template <typename Value>
Volume makeCuboid(const ShapeSize& size, const Value& value) {
  constexpr double kLeafFill = 0.5;
  requireFeasible(size, kLeafFill);
  const Coord side = boxSides(size.voxels);
  const double natural = kShapeWidth / std::cbrt(double(side[0]) * side[1] * side[2]);
  return filledBox(side, size.voxel_size > 0 ? size.voxel_size : natural, value);
}

/// Densities by the distance from the centre over the radius, inside a ball about voxel (0,0,0).
template <typename Value>
Volume makeBall(const ShapeSize& size, const Value& value) {
  constexpr double kLeafFill = 0.5, kRadius = 0.5 * kShapeWidth;
  requireFeasible(size, kLeafFill);
  const auto filled = [&](double h) {
    const int reach = static_cast<int>(std::ceil(kRadius / h));
    Formula formula;
    formula.lowest = Coord(-reach), formula.highest = Coord(reach);
    formula.fill = [&, h](const Coord& origin, float* values, BlockMask& active) {
      for (int n = 0; n < kBlockVoxels; ++n) {
        const double r = h / kRadius * (origin + voxelLocal(n)).asVec3d().length();
        if (r >= 1) continue;
        values[n] = static_cast<float>(value(r));
        active.setOn(n);
      }
    };
    return sparseFill(formula, h);
  };
  constexpr double kBallVolume = 4.0 / 3 * 3.14159265358979323846 * kRadius * kRadius * kRadius;
  return fillToSize(
      size, [](double) { return kBallVolume; }, filled);
}

}  // namespace

Volume makeSphere(const ShapeSize& size, double density) {
  return makeBall(size, [&](double) { return density; });
}

Volume makeShell(const ShapeSize& size, double density) {
  return makeBall(size, [&](double r) { return r < 0.5 ? 0 : density; });
}

Volume makeBox(const ShapeSize& size, double density) {
  return makeCuboid(size, [&](const Coord&) { return density; });
}

Volume makeLayers(const ShapeSize& size, double density, int cell) {
  constexpr double kSlabs = 8;
  if (cell < 1) cell = std::max(1, static_cast<int>(std::lround(boxSides(size.voxels)[2] / kSlabs)));
  return makeCuboid(size, [&](const Coord& p) { return p[2] / cell % 2 == 0 ? density : 0; });
}

Volume makeCheckerboard(const ShapeSize& size, double density, double contrast, int cell) {
  return makeCuboid(size, [&](const Coord& p) {
    return (p[0] / cell + p[1] / cell + p[2] / cell) % 2 == 0 ? density : density * contrast;
  });
}

Volume makeSheet(const ShapeSize& size, double optical_depth) {
  constexpr double kLeafFill = 1.0 / kBlockWidth;
  requireFeasible(size, kLeafFill);
  const Coord side = boxSides(size.voxels, 1);
  const double h = size.voxel_size > 0 ? size.voxel_size : kShapeWidth / std::sqrt(double(side[0]) * side[1]);
  return filledBox(side, h, [&](const Coord&) { return optical_depth / h; });
}

}  // namespace vdb_diffuse
