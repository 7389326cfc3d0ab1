#include "diffusion/equation.h"

#include <cmath>
#include <limits>
#include <optional>

#include "diffusion/area_factor.h"
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
    for (int n = 0; n < kBlockVoxels; ++n)
      area[n] *= std::max(e.settings.least_returned, e.settings.returned->block(b)[n]);
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
      const double resistance = s * (s * r[n] + surfaceResistance(e, wall, area[n]));
      open.g[face][n] = static_cast<float>(e.settings.opening / resistance);
      open.any = true;
    }
  }
}

/// The way from a times a voxel's mean to its upper and its lower face along an axis: what the drive and the
/// sources inside add, see equation.h. Zero in inactive voxels.
struct Heads {
  Field<float> upper, lower;
};

/// Is the unknown anything but the mean?
bool scalesMeans(const Equation& e) {
  return e.settings.profile && e.optics.sigma_a > 0;
}

/// How much of what scatters in a voxel leaves along each axis, see equation.h.
class Shares {
 public:
  Shares(const Equation& e, size_t b) : e_(e), b_(b) {
    loadHalo(*e.A->topology, e.A->half_resistance, b, std::numeric_limits<float>::infinity(), r_);
    walled_ = e.settings.walls && e.settings.walls->count(static_cast<int32_t>(b)) > 0;
  }
  void of(int voxel, double share[3]) const {
    const Coord p = voxelLocal(voxel);
    int open_axes = 0, passable_axes = 0;
    bool open[3], passable[3];
    for (int a = 0; a < 3; ++a) {
      open[a] = passable[a] = false;
      for (int up = 0; up < 2; ++up) {
        Coord next = p;
        next[a] += up ? 1 : -1;
        const WallFace* wall = walled_ ? wallAt(*e_.settings.walls, b_, voxel, 2 * a + up) : nullptr;
        const bool leads_out = wall ? (*e_.settings.surfaces)[wall->surface].albedo[e_.channel] < 1
                                    : std::isinf(r_.at(next[0], next[1], next[2]));
        open[a] = open[a] || leads_out;
        passable[a] = passable[a] || leads_out || !wall;
      }
      open_axes += open[a];
      passable_axes += passable[a];
    }
    for (int a = 0; a < 3; ++a) {
      if (open_axes > 0)
        share[a] = open[a] ? 1.0 / open_axes : 0.0;
      else
        share[a] = passable[a] ? 1.0 / passable_axes : 0.0;
    }
  }

 private:
  const Equation& e_;
  const size_t b_;
  Halo<float> r_;
  bool walled_;
};

/// \param I0  means, of which heads take what is missing from a times them to themselves; null: 0
void formHeads(const Equation& e, const Medium& medium, const BeamSource& beams, const Field<double>* I0,
               int axis, Heads& heads) {
  const Topology& topology = *e.A->topology;
  const double s = e.stretch[axis];
  const double drive = 0.5 * s * beams.scale * e.optics.sigma_s * e.h * 3 * e.optics.g;
  const double scatters = beams.scale * e.optics.source_sigma * e.h;
  const double glows = beams.Q0 && !medium.emission.empty()
                           ? beams.scale * e.optics.sigma_a * e.h * medium.optics.emission_scale
                           : 0;
  if (heads.upper.empty()) heads.upper = heads.lower = Field<float>(topology);
  forEachBlock(topology.blockCount(), [&](size_t b) {
    const float* rho = medium.density.values.block(b);
    const float* Q0 = beams.Q0 ? beams.Q0->block(b) : nullptr;
    const float* flux = beams.Q1_flux ? (*beams.Q1_flux)[axis].block(b) : nullptr;
    const float* lean = beams.shape ? beams.shape->lean[axis].block(b) : nullptr;
    const float* spread[3] = {};
    for (int a = 0; beams.shape && a < 3; ++a) spread[a] = beams.shape->spread[a].block(b);
    const float* Q = glows != 0 ? medium.emission.block(b) : nullptr;
    const double* mean = I0 ? I0->block(b) : nullptr;
    float *upper = heads.upper.block(b), *lower = heads.lower.block(b);
    const bool shaped = Q0 && e.settings.profile;
    std::optional<Shares> shares;
    if (shaped) shares.emplace(e, b);
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      const VoxelProfile profile = e.profile(rho[n]);
      double even = mean ? (profile.a - 1) * mean[n] : 0, odd = flux ? drive * rho[n] * flux[n] : 0;
      if (shaped) {
        double share[3];
        shares->of(n, share);
        // what is absorbed at once leaves nowhere
        const double part = share[axis] + (1 - share[axis]) * (1 - profile.a);
        const double along = profile.r * s * s, tau_s = scatters * rho[n];
        double leaves = part * tau_s * Q0[n] + (Q ? glows * rho[n] * Q[n] : 0);
        if (lean) {
          double skin[3], skins = 0;  // what scatters beside a face leaves through that
          for (int a = 0; a < 3; ++a) skins += skin[a] = 6 * tau_s * spread[a][n];
          leaves += skin[axis] - part * skins;
          even += along * profile.spread * skin[axis] / 6;
          odd += along * profile.lean * tau_s * lean[n];
        }
        even += along * profile.even * leaves;
      }
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
  e.resistance_per_depth = 1.5 / (model == Model::kPaper ? optics.flux_factor : 1);  // r = 1/(2D)
  e.least_depth = std::max(vacuum, per_cap);
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
      const VoxelProfile profile = e.profile(rho[n]);
      r[n] = static_cast<float>(profile.odd * profile.r);
    }
    OpenFaces open;
    findOpenFaces(e, b, open);
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      float sum = static_cast<float>(tau_a * rho[n] / e.profile(rho[n]).a);
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

VoxelProfile Equation::profile(float rho) const {
  const double r = resistance_per_depth * std::max(optics.sigma_tr * h * rho, least_depth);
  return settings.profile ? voxelProfile(std::min(r, settings.most_resistance), optics.sigma_a * h * rho)
                          : flatProfile(std::min(r, settings.most_resistance));
}

void meansOfSolution(const Equation& e, const Medium& medium, Field<double>& x) {
  if (!scalesMeans(e)) return;
  const Topology& topology = *e.A->topology;
  forEachBlock(topology.blockCount(), [&](size_t b) {
    const float* rho = medium.density.values.block(b);
    for (auto it = topology.active(b).beginOn(); it; ++it) x.block(b)[it.pos()] /= e.profile(rho[it.pos()]).a;
  });
}

template <typename T>
double escapedThrough(const Equation& e, const Medium& medium, const Field<T>& I0) {
  const Topology& topology = *e.A->topology;
  const double tau_a = e.optics.sigma_a * e.h;
  return sumOverBlocks<double>(topology.blockCount(), [&](size_t b) {
    const float *rho = medium.density.values.block(b), *sink = e.A->sink.block(b);
    double sum = 0;
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      const double a = e.profile(rho[n]).a;
      sum += a * (sink[n] - static_cast<float>(tau_a * rho[n] / a)) * I0.block(b)[n];
    }
    return sum;
  });
}
template double escapedThrough(const Equation&, const Medium&, const Field<float>&);
template double escapedThrough(const Equation&, const Medium&, const Field<double>&);

RightHandSide formRightHandSide(const Equation& e, const Medium& medium, const BeamSource& beams) {
  const Topology& topology = *e.A->topology;
  const double tau_s = e.optics.source_sigma * e.h * beams.scale;
  const double tau_a = e.optics.sigma_a * e.h * medium.optics.emission_scale * beams.scale;
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
    const float *rho = medium.density.values.block(b), *q0 = beams.Q0->block(b);
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
    formHeads(e, medium, beams, nullptr, axis, heads);
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
  const bool has_heads = beams.Q0 || scalesMeans(e);
  const double bends = beams.scale * e.optics.source_sigma * e.h;
  const double drive = beams.scale * e.optics.sigma_s * e.h * 3 * e.optics.g;
  Heads heads;
  for (int axis = 0; axis < 3; ++axis) {
    if (has_heads) formHeads(e, medium, beams, &I0, axis, heads);
    forEachBlock(topology.blockCount(), [&](size_t b) {
      BlockFaces g;
      OpenFaces open;
      Halo<double> u;
      Halo<float> upper, lower;
      loadFaces(*e.A, b, g);
      findOpenFaces(e, b, open);
      loadHalo(topology, I0, b, 0.0, u);
      if (has_heads) {
        loadHalo(topology, heads.upper, b, 0.0f, upper);
        loadHalo(topology, heads.lower, b, 0.0f, lower);
      } else {
        clear(upper);
        clear(lower);
      }
      const int dx = axis == 0, dy = axis == 1, dz = axis == 2;
      const double s = e.stretch[axis];  // conductances are per volume: times s is per area
      const float* rho = medium.density.values.block(b);
      const float* lean = beams.shape ? beams.shape->lean[axis].block(b) : nullptr;
      const float* Q1_flux = beams.Q1_flux ? (*beams.Q1_flux)[axis].block(b) : nullptr;
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
        if (!slope) continue;
        const VoxelProfile profile = e.profile(rho[n]);
        double steep = -profile.slope * s * s * profile.r * (below + above);
        if (lean) steep += bendOfProfile(profile) * s * s * profile.r * bends * rho[n] * lean[n];
        if (Q1_flux) steep += s * drive * rho[n] * Q1_flux[n];
        (*slope)[axis].block(b)[n] = static_cast<float>(steep);
      }
    });
  }
}

}  // namespace vdb_diffuse
