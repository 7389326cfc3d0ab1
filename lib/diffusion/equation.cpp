#include "diffusion/equation.h"

#include <cmath>
#include <limits>

#include "diffusion/area_factor.h"
#include "diffusion/source_shape.h"
#include "grid/error.h"
#include "multigrid/block_kernel.h"

namespace vdb_diffuse {
namespace {

/// Conductances through the sides of one block's voxels that lead out of the medium: a face beside an
/// inactive voxel, or a wall. Zero elsewhere.
struct OpenFaces {
  float g[6][kBlockVoxels];
  bool any = false;
};

double surfaceResistance(const Equation& e, const WallFace* wall, float area_factor) {
  if (!wall) return 2 / static_cast<double>(area_factor);
  const double R = (*e.settings.surfaces)[wall->surface].albedo[e.channel];
  const double area = e.settings.staircase ? wall->area : 1;
  return R < 1 ? 2 * (1 + R) / (1 - R) / area : std::numeric_limits<double>::infinity();
}

void findOpenFaces(const Equation& e, size_t b, OpenFaces& open) {
  const Topology& topology = *e.A->topology;
  const BlockMask& active = topology.active(b);
  const Walls no_walls;
  const Walls& walls = e.settings.walls ? *e.settings.walls : no_walls;
  const float* r = e.A->half_resistance.block(b);
  float area[kBlockVoxels];
  if (e.settings.staircase)
    areaFactors(topology, Vec3d(e.stretch[0], e.stretch[1], e.stretch[2]), b, area);
  else
    std::fill_n(area, kBlockVoxels, 1.0f);
  if (e.settings.returned)
    for (int n = 0; n < kBlockVoxels; ++n) area[n] *= e.settings.returned->block(b)[n];
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2, up = face % 2, stride = 64 >> (3 * axis), shift = 6 - 3 * axis;
    const int32_t across = topology.neighbours(b)[face];
    const double s = e.stretch[axis];
    std::fill_n(open.g[face], kBlockVoxels, 0.0f);
    for (auto it = active.beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      const int place = n >> shift & 7;
      bool next;
      if (place == (up ? 7 : 0))
        next = across != kNoBlock && topology.active(across).isOn(up ? n - 7 * stride : n + 7 * stride);
      else
        next = active.isOn(up ? n + stride : n - stride);
      const WallFace* wall = wallAt(walls, b, n, face);
      if (next && !wall) continue;
      open.g[face][n] = static_cast<float>(1 / (s * (s * r[n] + surfaceResistance(e, wall, area[n]))));
      open.any = true;
    }
  }
}

/// What the sources inside voxels add to I0 on the way from a voxel's centre to its upper and its lower face
/// along an axis, both in voxels' units of I0: see equation.h. Zero in inactive voxels.
struct Heads {
  Field<float> upper, lower;
};

void formHeads(const Equation& e, const Medium& medium, const Field<float>& Q0, const VectorField* Q1_flux,
               double scale, int axis, Heads& heads) {
  const Topology& topology = *e.A->topology;
  const double s = e.stretch[axis];
  const double drive = 0.5 * s * scale * e.optics.sigma_s * e.h * 3 * e.optics.g;
  const double extinction = e.optics.sigma_t_beam * e.h * s;
  const double inside = 2 * s * s * scale * e.optics.source_sigma * e.h;  // times r: h / D
  if (heads.upper.empty()) heads.upper = heads.lower = Field<float>(topology);
  forEachBlock(topology.blockCount(), [&](size_t b) {
    const float *rho = medium.density.values.block(b), *Q = Q0.block(b);
    const float* flux = Q1_flux ? (*Q1_flux)[axis].block(b) : nullptr;
    float *upper = heads.upper.block(b), *lower = heads.lower.block(b);
    Halo<float> r;
    loadHalo(topology, e.A->half_resistance, b, std::numeric_limits<float>::infinity(), r);
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      const Coord p = voxelLocal(n);
      bool open[3];
      for (int a = 0; a < 3; ++a) {
        const int dx = a == 0, dy = a == 1, dz = a == 2;
        open[a] = std::isinf(r.at(p[0] - dx, p[1] - dy, p[2] - dz)) ||
                  std::isinf(r.at(p[0] + dx, p[1] + dy, p[2] + dz));
      }
      const int open_axes = open[0] + open[1] + open[2];
      const double share = open_axes == 0 ? 1.0 / 3 : open[axis] ? 1.0 / open_axes : 0.0;
      const double source = inside * r.at(p[0], p[1], p[2]) * rho[n], even = source * share * Q[n] / 8;
      const double odd = flux ? (drive * rho[n] + source * beamAhead(extinction * rho[n])) * flux[n] : 0;
      upper[n] = static_cast<float>(even + odd);
      lower[n] = static_cast<float>(even - odd);
    }
  });
}

/// The face between a voxel and the one below it along an axis; `above` takes the one above it.
float faceAt(const BlockFaces& g, int axis, const Coord& p, bool above) {
  const int x = p[0], y = p[1], z = p[2];
  if (axis == 0) return g.x[x + above][y][z];
  if (axis == 1) return g.y[x][y + above][z];
  return above ? g.above[x][y][z] : g.below[x][y][z];
}

}  // namespace

Equation formEquation(const Medium& medium, const ChannelOptics& optics, int channel, Model model,
                      const EquationSettings& settings) {
  Equation e;
  e.optics = optics;
  e.settings = settings;
  e.channel = channel;
  e.h = medium.transform().meanVoxelSize();
  const Topology& topology = medium.topology();
  auto A = std::make_shared<Operator>();
  e.A = A;
  A->topology = medium.density.topology;
  for (int a = 0; a < 3; ++a) {
    e.stretch[a] = medium.transform().voxelSize()[a] / e.h;
    A->scale[a] = static_cast<float>(1 / (e.stretch[a] * e.stretch[a]));
  }
  const bool capped = std::isfinite(settings.cap);
  const double per_cap = capped ? e.h / settings.cap : 0;
  const double size = std::cbrt(static_cast<double>(topology.activeVoxelCount()));  // in voxels
  const double vacuum = capped ? 0 : 1 / (kVacuumPath * size);
  const double tau_tr = optics.sigma_tr * e.h, tau_a = optics.sigma_a * e.h;
  const double half = 1.5 / (model == Model::kPaper ? optics.flux_factor : 1);  // r = 1/(2D) = 3/2 tau_tr rho
  A->half_resistance = Field<float>(topology, std::numeric_limits<float>::infinity());
  A->sink = Field<float>(topology);
  if (settings.walls)
    for (const auto& [block, faces] : *settings.walls)
      for (const WallFace& wall : faces) A->cuts[block].cut[wall.face].setOn(wall.voxel);
  e.floored_voxels = sumOverBlocks<size_t>(topology.blockCount(), [&](size_t b) {
    const float* rho = medium.density.values.block(b);
    float *r = A->half_resistance.block(b), *sink = A->sink.block(b);
    size_t floored = 0;
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      const double tau = tau_tr * rho[n];
      floored += tau < vacuum;
      r[n] = static_cast<float>(half * std::max({tau, vacuum, per_cap}));
    }
    OpenFaces open;
    findOpenFaces(e, b, open);
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      float sum = static_cast<float>(tau_a * rho[n]);
      for (const float* g : open.g) sum += g[n];
      sink[n] = sum;
    }
    return floored;
  });
  const double sinks = sumOverBlocks<double>(topology.blockCount(), [&](size_t b) {
    double sum = 0;
    for (int n = 0; n < kBlockVoxels; ++n) sum += A->sink.block(b)[n];
    return sum;
  });
  if (!(sinks > 0) && topology.blockCount() > 0)
    throw InputError(
        "the medium absorbs nothing and no light can leave it (closed by surfaces of albedo 1): "
        "give it some absorption or an opening");
  formDiagonal(*A);
  return e;
}

RightHandSide formRightHandSide(const Equation& e, const Medium& medium, const Field<float>& Q0,
                                const VectorField* Q1_flux, double scale) {
  const Topology& topology = *e.A->topology;
  const double tau_s = e.optics.source_sigma * e.h * scale;
  const double tau_a = e.optics.sigma_a * e.h * medium.optics.emission_scale * scale;
  struct Sums {
    double scattered = 0, emitted = 0;
    void operator+=(const Sums& o) {
      scattered += o.scattered;
      emitted += o.emitted;
    }
  };
  RightHandSide rhs;
  rhs.b = Field<float>(topology);
  const Sums sums = sumOverBlocks<Sums>(topology.blockCount(), [&](size_t b) {
    Sums sum;
    const float *rho = medium.density.values.block(b), *q0 = Q0.block(b);
    const float* emission = medium.emission.empty() ? nullptr : medium.emission.block(b);
    float* out = rhs.b.block(b);
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      const double scattered = tau_s * rho[n] * q0[n], emitted = emission ? tau_a * rho[n] * emission[n] : 0;
      sum.scattered += scattered;
      sum.emitted += emitted;
      out[n] = static_cast<float>(scattered + emitted);
    }
    return sum;
  });
  Heads heads;
  for (int axis = 0; axis < 3; ++axis) {
    formHeads(e, medium, Q0, Q1_flux, scale, axis, heads);
    rhs.drive_out += sumOverBlocks<double>(topology.blockCount(), [&](size_t b) {
      BlockFaces g;
      OpenFaces open;
      Halo<float> upper, lower;
      loadFaces(*e.A, b, g);
      findOpenFaces(e, b, open);
      loadHalo(topology, heads.upper, b, 0.0f, upper);
      loadHalo(topology, heads.lower, b, 0.0f, lower);
      float* out = rhs.b.block(b);
      double sum = 0;
      const int dx = axis == 0, dy = axis == 1, dz = axis == 2;
      for (auto it = topology.active(b).beginOn(); it; ++it) {
        const int n = static_cast<int>(it.pos());
        const Coord p = voxelLocal(n);
        const double up = upper.at(p[0], p[1], p[2]), down = lower.at(p[0], p[1], p[2]);
        const double in = faceAt(g, axis, p, false) * (upper.at(p[0] - dx, p[1] - dy, p[2] - dz) - down);
        const double on = faceAt(g, axis, p, true) * (up - lower.at(p[0] + dx, p[1] + dy, p[2] + dz));
        const double outward = open.g[2 * axis + 1][n] * up + open.g[2 * axis][n] * down;
        sum += outward;
        out[n] += static_cast<float>(in - on - outward);
      }
      return sum;
    });
  }
  rhs.scattered_in = sums.scattered;
  rhs.emitted = sums.emitted;
  return rhs;
}

void diffusiveFlux(const Equation& e, const Medium& medium, const Field<double>& I0, const BeamSource& beams,
                   VectorField* flux, VectorField* slope) {
  const Topology& topology = *e.A->topology;
  Heads heads;
  for (int axis = 0; axis < 3; ++axis) {
    if (beams.Q0) formHeads(e, medium, *beams.Q0, beams.Q1_flux, beams.scale, axis, heads);
    forEachBlock(topology.blockCount(), [&](size_t b) {
      BlockFaces g;
      OpenFaces open;
      Halo<double> u;
      Halo<float> upper, lower;
      loadFaces(*e.A, b, g);
      findOpenFaces(e, b, open);
      loadHalo(topology, I0, b, 0.0, u);
      if (beams.Q0) {
        loadHalo(topology, heads.upper, b, 0.0f, upper);
        loadHalo(topology, heads.lower, b, 0.0f, lower);
      } else {
        clear(upper);
        clear(lower);
      }
      const int dx = axis == 0, dy = axis == 1, dz = axis == 2;
      const double s = e.stretch[axis];  // conductances are per volume: times s is per area
      const float* r = e.A->half_resistance.block(b);
      for (auto it = topology.active(b).beginOn(); it; ++it) {
        const int n = static_cast<int>(it.pos());
        const Coord p = voxelLocal(n);
        const auto at = [&](const auto& f, int step) -> double {
          return f.at(p[0] + step * dx, p[1] + step * dy, p[2] + step * dz);
        };
        const double high = at(u, 0) + at(upper, 0), low = at(u, 0) + at(lower, 0);
        const double below =
            faceAt(g, axis, p, false) * (at(u, -1) + at(upper, -1) - low) - open.g[2 * axis][n] * low;
        const double above =
            faceAt(g, axis, p, true) * (high - at(u, 1) - at(lower, 1)) + open.g[2 * axis + 1][n] * high;
        if (flux) (*flux)[axis].block(b)[n] = static_cast<float>(0.5 * s * (below + above));
        if (slope)
          (*slope)[axis].block(b)[n] = static_cast<float>(high - low - s * s * r[n] * (below + above));
      }
    });
  }
}

}  // namespace vdb_diffuse
