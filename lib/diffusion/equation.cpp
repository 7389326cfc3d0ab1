#include "diffusion/equation.h"

#include <cmath>
#include <limits>

#include "diffusion/area_factor.h"
#include "diffusion/face_heads.h"
#include "grid/error.h"
#include "multigrid/block_kernel.h"

namespace vdb_diffuse {
namespace {

double surfaceResistance(const Equation& e, const WallFace* wall, float area_factor) {
  if (!wall) return 2 / static_cast<double>(area_factor);
  const double R = (*e.settings.surfaces)[wall->surface].albedo[e.channel];
  const double area = e.settings.staircase ? wall->area : 1;
  return R < 1 ? 2 * (1 + R) / (1 - R) / area : std::numeric_limits<double>::infinity();
}

std::vector<OpenFace> findOpenFaces(const Equation& e, size_t b) {
  const Topology& topology = *e.A->topology;
  std::array<BlockMask, 6> faces = topology.outerFaces(b);
  const Walls no_walls;
  const Walls& walls = e.settings.walls ? *e.settings.walls : no_walls;
  if (const auto list = walls.find(static_cast<int32_t>(b)); list != walls.end())
    for (const WallFace& wall : list->second) faces[wall.face].setOn(wall.voxel);
  std::vector<OpenFace> open;
  size_t count = 0;
  for (const BlockMask& mask : faces) count += mask.countOn();
  if (count == 0) return open;
  open.reserve(count);
  float area[kBlockVoxels];
  if (e.settings.staircase)
    areaFactors(topology, Vec3d(e.stretch[0], e.stretch[1], e.stretch[2]), b, area);
  else
    std::fill_n(area, kBlockVoxels, 1.0f);
  if (e.settings.returned)
    for (int n = 0; n < kBlockVoxels; ++n)
      area[n] *= std::max(e.settings.least_returned, e.settings.returned->block(b)[n]);
  const float* r = e.A->half_resistance.block(b);
  for (int face = 0; face < 6; ++face) {
    const double s = e.stretch[face / 2];
    for (auto it = faces[face].beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      const double resistance = s * (s * r[n] + surfaceResistance(e, wallAt(walls, b, n, face), area[n]));
      open.push_back({static_cast<uint16_t>(n), static_cast<uint8_t>(face),
                      static_cast<float>(e.settings.opening / resistance)});
    }
  }
  return open;
}

/// The rows of conductance below and above the voxels of row (x, y) along an axis.
VDB_DIFFUSE_INLINE std::pair<Row, Row> faceRows(const BlockFaces& g, int axis, int x, int y) {
  if (axis == 0) return {loadRow(g.x[x][y]), loadRow(g.x[x + 1][y])};
  if (axis == 1) return {loadRow(g.y[x][y]), loadRow(g.y[x][y + 1])};
  return {loadRow(g.below[x][y]), loadRow(g.above[x][y])};
}
/// The row next to (x, y) along an axis, downward or upward.
VDB_DIFFUSE_INLINE Row rowBelow(const Halo<float>& f, int axis, int x, int y) {
  if (axis == 2) return shiftedUp(loadRow(f.row(x, y)), f.below[x][y]);
  return loadRow(f.row(x - (axis == 0), y - (axis == 1)));
}
VDB_DIFFUSE_INLINE Row rowAbove(const Halo<float>& f, int axis, int x, int y) {
  if (axis == 2) return shiftedDown(loadRow(f.row(x, y)), f.above[x][y]);
  return loadRow(f.row(x + (axis == 0), y + (axis == 1)));
}

/// What heads alone send through the faces below and above the voxels of a row.
struct HeadFlow {
  Halo<float> upper, lower;
  VDB_DIFFUSE_INLINE HeadFlow(const Topology& topology, const FaceHeads& heads, size_t b) {
    loadHalo(topology, heads.upper, b, 0.0f, upper);
    loadHalo(topology, heads.lower, b, 0.0f, lower);
  }
  VDB_DIFFUSE_INLINE Row below(const Row& g, int axis, int x, int y) const {
    return g * (rowBelow(upper, axis, x, y) - loadRow(lower.row(x, y)));
  }
  VDB_DIFFUSE_INLINE Row above(const Row& g, int axis, int x, int y) const {
    return g * (loadRow(upper.row(x, y)) - rowAbove(lower, axis, x, y));
  }
};

/// Flow along an axis through the faces below and above each voxel of a block, together.
VDB_DIFFUSE_KERNEL void flowOfBlock(const Equation& e, const Field<double>& I0, const FaceHeads* heads,
                                    const FaceValues* incoming, int axis, size_t b, float* flow) {
  const Topology& topology = *e.A->topology;
  BlockFaces g;
  Halo<double> u;
  loadFaces(*e.A, b, g);
  loadHalo(topology, I0, b, 0.0, u);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      const auto [below, above] = faceRows(g, axis, x, y);
      const double* own = u.row(x, y);
      const double *low = u.row(x - (axis == 0), y - (axis == 1)),
                   *high = u.row(x + (axis == 0), y + (axis == 1));
      float* out = flow + voxelOffset(x, y, 0);
      for (int z = 0; z < 8; ++z) {
        const double before = axis == 2 ? u.at(x, y, z - 1) : low[z],
                     after = axis == 2 ? u.at(x, y, z + 1) : high[z];
        out[z] =
            below[z] * static_cast<float>(before - own[z]) + above[z] * static_cast<float>(own[z] - after);
      }
    }
  if (heads) {
    const HeadFlow sent(topology, *heads, b);
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 8; ++y) {
        const auto [below, above] = faceRows(g, axis, x, y);
        float* out = flow + voxelOffset(x, y, 0);
        storeRow(out, loadRow(out) + (sent.below(below, axis, x, y) + sent.above(above, axis, x, y)));
      }
  }
  for (size_t k = 0; k < e.open[b].size(); ++k) {
    const OpenFace& face = e.open[b][k];
    if (face.face / 2 != axis) continue;
    const int n = face.voxel;
    const bool up = face.face % 2;
    double value = I0.block(b)[n];
    if (heads) value += (up ? heads->upper : heads->lower).block(b)[n];
    if (incoming) value -= (*incoming)[b][k];
    flow[n] += static_cast<float>((up ? face.g : -face.g) * value);
  }
}

/// Adds to b what heads send through the faces along an axis; returns what they send out.
/// \param at_faces  out: the heads of the block's open faces along the axis; may be null
VDB_DIFFUSE_KERNEL double addHeadsOfBlock(const Equation& e, const FaceHeads& heads, int axis, size_t b,
                                          float* out, float* at_faces) {
  const Topology& topology = *e.A->topology;
  BlockFaces g;
  loadFaces(*e.A, b, g);
  const HeadFlow sent(topology, heads, b);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      const auto [below, above] = faceRows(g, axis, x, y);
      float* to = out + voxelOffset(x, y, 0);
      storeRow(to, loadRow(to) + (sent.below(below, axis, x, y) - sent.above(above, axis, x, y)));
    }
  double sum = 0;
  for (size_t k = 0; k < e.open[b].size(); ++k) {
    const OpenFace& face = e.open[b][k];
    if (face.face / 2 != axis) continue;
    const float head = (face.face % 2 ? heads.upper : heads.lower).block(b)[face.voxel];
    const double outward = face.g * head;
    if (at_faces) at_faces[k] = head;
    sum += outward;
    out[face.voxel] -= static_cast<float>(outward);
  }
  return sum;
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
  e.resistance_per_depth = 1.5 / (model == Model::kPaper ? optics.flux_factor : 1);  // r = 1/(2D)
  e.least_depth = std::max(vacuum, per_cap);
  A->half_resistance = Field<float>(topology, std::numeric_limits<float>::infinity());
  A->sink = Field<float>(topology);
  if (settings.walls)
    for (const auto& [block, faces] : *settings.walls)
      for (const WallFace& wall : faces) A->cuts[block].cut[wall.face].setOn(wall.voxel);
  e.open.resize(topology.blockCount());
  e.floored_voxels = sumOverBlocks<size_t>(topology.blockCount(), [&](size_t b) {
    const float* rho = medium.density.values.block(b);
    float *r = A->half_resistance.block(b), *sink = A->sink.block(b);
    size_t floored = 0;
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      const ChannelOptics there = optics.at(b, n);
      floored += there.sigma_tr * e.h * rho[n] < vacuum;
      const VoxelProfile profile = e.profile(there, rho[n]);
      r[n] = static_cast<float>(profile.odd * profile.r);
      sink[n] = static_cast<float>(there.sigma_a * e.h * rho[n] / profile.a);
    }
    e.open[b] = findOpenFaces(e, b);
    for (const OpenFace& face : e.open[b]) sink[face.voxel] += face.g;
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
  if (settings.diagonal) formDiagonal(*A);
  return e;
}

VoxelProfile Equation::profile(double sigma_tr, double sigma_a, float rho) const {
  const double r = resistance_per_depth * std::max(sigma_tr * h * rho, least_depth);
  return settings.profile ? voxelProfile(std::min(r, settings.most_resistance), sigma_a * h * rho)
                          : flatProfile(std::min(r, settings.most_resistance));
}

void meansOfSolution(const Equation& e, const Medium& medium, Field<double>& x) {
  if (!e.scalesMeans()) return;
  const Topology& topology = *e.A->topology;
  forEachBlock(topology.blockCount(), [&](size_t b) {
    const float* rho = medium.density.values.block(b);
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      x.block(b)[n] /= e.profile(e.optics.at(b, n), rho[n]).a;
    }
  });
}

template <typename T>
double escapedThrough(const Equation& e, const Medium& medium, const Field<T>& I0) {
  return sumOverBlocks<double>(e.open.size(), [&](size_t b) {
    const float* rho = medium.density.values.block(b);
    double sum = 0;
    for (const OpenFace& face : e.open[b])
      sum += e.profile(e.optics.at(b, face.voxel), rho[face.voxel]).a * face.g * I0.block(b)[face.voxel];
    return sum;
  });
}
template double escapedThrough(const Equation&, const Medium&, const Field<float>&);
template double escapedThrough(const Equation&, const Medium&, const Field<double>&);

RightHandSide formRightHandSide(const Equation& e, const Medium& medium, const BeamSource& beams,
                                FaceValues* at_faces) {
  const Topology& topology = *e.A->topology;
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
    const float* glow = beams.glow ? beams.glow->block(b) : nullptr;
    const float* gathered = beams.gathered ? beams.gathered->block(b) : nullptr;
    float* out = rhs.b.block(b);
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      const ChannelOptics there = e.optics.at(b, n);
      const double tau_s = there.source_sigma * e.h * beams.scale;
      const double tau_a = there.sigma_a * e.h * medium.optics.emission_scale * beams.scale;
      const double scattered = tau_s * rho[n] * q0[n] * (gathered ? gathered[n] : 1),
                   emitted = glow ? tau_a * rho[n] * glow[n] : 0;
      sum.scattered += scattered;
      sum.emitted += emitted;
      out[n] = static_cast<float>(scattered + emitted);
    }
    return sum;
  });
  const bool has_heads = e.settings.profile || beams.Q1_flux;
  if (at_faces) {
    at_faces->resize(topology.blockCount());
    for (size_t b = 0; b < topology.blockCount(); ++b) (*at_faces)[b].assign(e.open[b].size(), 0);
  }
  FaceHeads heads;
  for (int axis = 0; axis < 3 && has_heads; ++axis) {
    formFaceHeads(e, medium, beams, nullptr, axis, heads);
    rhs.drive_out += sumOverBlocks<double>(topology.blockCount(), [&](size_t b) {
      return addHeadsOfBlock(e, heads, axis, b, rhs.b.block(b), at_faces ? (*at_faces)[b].data() : nullptr);
    });
  }
  rhs.scattered_in = sums.scattered;
  rhs.emitted = sums.emitted;
  return rhs;
}

void addIncoming(const Equation& e, const FaceValues& incoming, RightHandSide& rhs) {
  rhs.drive_out -= sumOverBlocks<double>(e.open.size(), [&](size_t b) {
    double sum = 0;
    for (size_t k = 0; k < e.open[b].size(); ++k) {
      const double enters = e.open[b][k].g * incoming[b][k];
      rhs.b.block(b)[e.open[b][k].voxel] += static_cast<float>(enters);
      sum += enters;
    }
    return sum;
  });
}

void diffusiveFlux(const Equation& e, const Medium& medium, const Field<double>& I0, const BeamSource& beams,
                   VectorField* flux, VectorField* slope) {
  const Topology& topology = *e.A->topology;
  const bool has_heads = beams.Q0 || e.scalesMeans();
  FaceHeads heads;
  for (int axis = 0; axis < 3; ++axis) {
    if (has_heads) formFaceHeads(e, medium, beams, &I0, axis, heads);
    const double s = e.stretch[axis];  // conductances are per volume: times s is per area
    forEachBlock(topology.blockCount(), [&](size_t b) {
      alignas(64) float flow[kBlockVoxels];  // through both faces together
      flowOfBlock(e, I0, has_heads ? &heads : nullptr, beams.incoming, axis, b, flow);
      if (flux) {
        float* out = (*flux)[axis].block(b);
        for (int n = 0; n < kBlockVoxels; ++n) out[n] = static_cast<float>(0.5 * s) * flow[n];
      }
      if (!slope) return;
      const float* rho = medium.density.values.block(b);
      const float* lean = beams.shape ? beams.shape->lean[axis].block(b) : nullptr;
      const float* Q1_flux = beams.Q1_flux ? (*beams.Q1_flux)[axis].block(b) : nullptr;
      for (auto it = topology.active(b).beginOn(); it; ++it) {
        const int n = static_cast<int>(it.pos());
        const ChannelOptics there = e.optics.at(b, n);
        const VoxelProfile profile = e.profile(there, rho[n]);
        double steep = -profile.slope * s * s * profile.r * flow[n];
        if (lean) {
          const double bends = beams.scale * there.source_sigma * e.h;
          steep += bendOfProfile(profile) * s * s * profile.r * bends * rho[n] * lean[n];
        }
        if (Q1_flux) {
          const double drive = beams.scale * there.sigma_s * e.h * 3 * there.g;
          steep += s * drive * rho[n] * Q1_flux[n];
        }
        (*slope)[axis].block(b)[n] = static_cast<float>(steep);
      }
    });
  }
}

}  // namespace vdb_diffuse
