#include "medium/ray_lattice.h"

#include <algorithm>
#include <cmath>

namespace vdb_diffuse {
namespace {

/// The rays' steps through a layer that they enter at (e_u, e_v) from a voxel's centre, moving by (d_u, d_v).
Layer stepsOf(int shift_u, int shift_v, double e_u, double e_v, double d_u, double d_v, int sign) {
  constexpr double kNothing = 1e-9;  // a step shorter than this is rounding
  Layer layer;
  double a = 0;
  const auto crossing = [&](double e, double d) {  // fraction of the layer at which the voxel's side is met
    return d > 0 ? (0.5 - e) / d : d < 0 ? (-0.5 - e) / d : 2.0;
  };
  double a_u = crossing(e_u, d_u), a_v = crossing(e_v, d_v);
  int entered_by = 0;
  while (a < 1) {
    const double end = std::min({a_u, a_v, 1.0});
    if (end - a > kNothing && layer.steps < 3) {
      LayerStep& step = layer.step[layer.steps++];
      step.shift_u = shift_u;
      step.shift_v = shift_v;
      step.extent = static_cast<float>(end - a);
      step.entered_by = entered_by;
      step.left_by = end == a_u ? 1 : end == a_v ? 2 : 0;
      const double enters[3] = {sign * (a - 0.5), e_u + a * d_u, e_v + a * d_v};
      const double moves[3] = {sign * (end - a), d_u * (end - a), d_v * (end - a)};
      for (int axis = 0; axis < 3; ++axis) {
        step.enters[axis] = static_cast<float>(enters[axis]);
        step.moves[axis] = static_cast<float>(moves[axis]);
      }
    }
    a = std::max(a, end);
    if (end == a_u) {
      shift_u += d_u > 0 ? 1 : -1;
      e_u -= d_u > 0 ? 1 : -1;
      a_u = 2;
      entered_by = 1;
    } else if (end == a_v) {
      shift_v += d_v > 0 ? 1 : -1;
      e_v -= d_v > 0 ? 1 : -1;
      a_v = 2;
      entered_by = 2;
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    double mean = 0, square = 0;
    for (int n = 0; n < layer.steps; ++n) {
      const LayerStep& step = layer.step[n];
      const double middle = step.enters[axis] + 0.5 * step.moves[axis];
      mean += step.extent * middle;
      square += step.extent * (middle * middle + step.moves[axis] * step.moves[axis] / 12);
    }
    layer.centre[axis] = static_cast<float>(mean);
    layer.square[axis] = static_cast<float>(square);
  }
  return layer;
}

}  // namespace

LatticeAxes latticeAxes(const Vec3d& s, const Vec3d& stretch) {
  int w = 0;
  for (int a = 1; a < 3; ++a)
    if (std::abs(s[a] / stretch[a]) > std::abs(s[w] / stretch[w]) * (1 + 1e-9)) w = a;
  const int v = w == 2 ? 1 : 2;
  return {w, 3 - w - v, v};
}

RayLattice makeRayLattice(const Vec3d& s, double weight, const Vec3d& stretch, const Coord& lowest,
                          const Coord& highest, const Vec3d& through) {
  RayLattice lattice;
  lattice.s = s;
  lattice.weight = weight;
  const Vec3d d(s[0] / stretch[0], s[1] / stretch[1], s[2] / stretch[2]);
  const auto [w, u, v] = latticeAxes(s, stretch);
  lattice.w = w;
  lattice.u = u;
  lattice.v = v;
  lattice.sign = d[w] > 0 ? 1 : -1;
  lattice.length = static_cast<float>(1 / std::abs(d[w]));
  lattice.cross_section = stretch[u] * stretch[v] * std::abs(s[w]);
  const double d_u = d[u] / std::abs(d[w]), d_v = d[v] / std::abs(d[w]);

  lattice.first_layer = lowest[w];
  lattice.along = d / std::abs(d[w]);
  const double before = lattice.sign * ((lattice.sign > 0 ? lowest[w] : highest[w]) - through[w]) - 0.5;
  lattice.start = through + lattice.along * before;
  int least_u = 0, most_u = 0, least_v = 0, most_v = 0;
  for (int layer = lowest[w]; layer <= highest[w]; ++layer) {
    const double travelled =
        lattice.sign * (layer - through[w]) - 0.5;  // from `through` to the layer's near side
    const double at_u = through[u] + d_u * travelled, at_v = through[v] + d_v * travelled;
    const double shift_u = std::floor(at_u + 0.5), shift_v = std::floor(at_v + 0.5);
    lattice.layers.push_back(stepsOf(static_cast<int>(shift_u), static_cast<int>(shift_v), at_u - shift_u,
                                     at_v - shift_v, d_u, d_v, lattice.sign));
    for (int n = 0; n < lattice.layers.back().steps; ++n) {
      const LayerStep& step = lattice.layers.back().step[n];
      const bool first = layer == lowest[w] && n == 0;
      least_u = first ? step.shift_u : std::min(least_u, step.shift_u);
      most_u = first ? step.shift_u : std::max(most_u, step.shift_u);
      least_v = first ? step.shift_v : std::min(least_v, step.shift_v);
      most_v = first ? step.shift_v : std::max(most_v, step.shift_v);
    }
  }
  lattice.first_u = lowest[u] - most_u;
  lattice.first_v = lowest[v] - most_v;
  lattice.rows = highest[u] - least_u - lattice.first_u + 1;
  lattice.pitch = highest[v] - least_v - lattice.first_v + 1;
  return lattice;
}

}  // namespace vdb_diffuse
