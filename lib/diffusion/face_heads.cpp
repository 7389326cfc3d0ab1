#include "diffusion/face_heads.h"

#include <algorithm>

#include "grid/row.h"

namespace vdb_diffuse {
namespace {

/// How much of what scatters in a block's voxels leaves along each axis, see equation.h.
class Shares {
 public:
  explicit Shares(const std::vector<OpenFace>& faces) {
    for (auto& share : share_) std::fill_n(share, kBlockVoxels, 1.0f / 3);
    if (faces.empty()) return;
    // bits of a voxel's axes: with a face that leads out; with the lower, the upper face shut by a wall
    uint8_t open[kBlockVoxels] = {}, shut[2][kBlockVoxels] = {};
    for (const OpenFace& face : faces)
      (face.g > 0 ? open : shut[face.face % 2])[face.voxel] |= static_cast<uint8_t>(1 << face.face / 2);
    for (const OpenFace& face : faces) {
      const int n = face.voxel;
      const int leave = open[n] ? open[n] : 7 & ~(shut[0][n] & shut[1][n]);
      for (int a = 0; a < 3; ++a)
        share_[a][n] = leave >> a & 1 ? 1.0f / static_cast<float>(__builtin_popcount(leave)) : 0.0f;
    }
  }
  const float* along(int axis) const { return share_[axis]; }

 private:
  alignas(64) float share_[3][kBlockVoxels];
};

/// What a profile says about heads; `a` as what it lacks to 1, which may be very little.
template <typename T>
struct ProfileTerms {
  T r, one_less_a, even, lean, spread;
};

/// What drives a voxel: fields at the voxel, those that are not there 0. `scattering` is the density times
/// the albedo field, and `lost` what it is less than the density.
template <typename T>
struct VoxelDrive {
  T rho, scattering, lost, share, Q0, Q, flux, lean, spread[3], mean;
};

template <typename T>
struct HeadPair {
  T upper, lower;
};

/// Factors of one channel and axis.
struct HeadFactors {
  double s, drive, scatters, glows, glows_lost;
  int axis;
  bool shaped;  ///< the equation asks where in the voxel light scatters
};

/// kVaries: there is an albedo field.
template <bool kVaries, typename T, typename Number>
VDB_DIFFUSE_INLINE HeadPair<T> headsOf(const HeadFactors& f, const ProfileTerms<T>& p,
                                       const VoxelDrive<T>& v) {
  const auto number = [](double x) { return static_cast<Number>(x); };
  T even = -p.one_less_a * v.mean, odd = v.scattering * v.flux * number(f.drive);
  if (f.shaped) {
    // what is absorbed at once leaves nowhere
    const T part = v.share + (number(1) - v.share) * p.one_less_a;
    const T along = p.r * number(f.s * f.s), scatters = v.scattering * number(f.scatters);
    const T skin = number(6) * scatters * v.spread[f.axis];  // what scatters beside a face leaves through it
    const T skins = number(6) * scatters * (v.spread[0] + v.spread[1] + v.spread[2]);
    T leaves = part * (scatters * v.Q0 - skins) + skin + v.rho * v.Q * number(f.glows);
    if constexpr (kVaries) leaves += v.lost * v.Q * number(f.glows_lost);
    even += along * (p.even * leaves + p.spread * skin * number(1. / 6));
    odd += along * p.lean * (scatters * v.lean);  // its factors alone may be beyond a float
  }
  return {even + odd, even - odd};
}

/// Fields of a block; null where there is none.
struct BlockDrive {
  const float *rho, *albedo, *share, *gathered, *Q0, *Q, *flux, *lean, *spread[3];
  const double* mean;
};

VDB_DIFFUSE_INLINE Row rowOf(const float* field, int n) {
  return field ? loadRow(field + n) : Row{};
}
VDB_DIFFUSE_INLINE Row rowOf(const double* field, int n) {
  Row row{};
  for (int z = 0; field && z < 8; ++z) row[z] = static_cast<float>(field[n + z]);
  return row;
}

template <bool kVaries>
VDB_DIFFUSE_INLINE void headsOfRows(const Equation& e, const HeadFactors& f, const BlockDrive& block,
                                    const uint8_t* active, float* upper, float* lower) {
  const float tau_tr = static_cast<float>(e.optics.sigma_tr * e.h), least = static_cast<float>(e.least_depth),
              per_depth = static_cast<float>(e.resistance_per_depth),
              most = static_cast<float>(std::min(e.settings.most_resistance, 1e30)),
              tau_a = static_cast<float>(e.optics.sigma_a * e.h),
              tau_s = static_cast<float>(e.optics.true_sigma_s * e.h),
              g = static_cast<float>(e.optics.true_g);
  const bool profiled = e.settings.profile;
  for (int row = 0; row < kBlockVoxels / 8; ++row) {
    const int n = 8 * row;
    if (!active[row]) {
      storeRow(upper + n, Row{});
      storeRow(lower + n, Row{});
      continue;
    }
    const Row rho = loadRow(block.rho + n);
    const Row gathered = block.gathered ? loadRow(block.gathered + n) : Row{} + 1;
    Row scattering = rho, lost{}, depth = rho * tau_tr, absorbing = rho * tau_a;
    if constexpr (kVaries) {
      scattering = rho * loadRow(block.albedo + n);
      lost = rho - scattering;
      depth += lost * (tau_s * g);
      absorbing += lost * tau_s;
    }
    Row r = (depth > least ? depth : Row{} + least) * per_depth;
    r = r < most ? r : Row{} + most;
    const Row k2 = 2.0f * r * absorbing;
    float most_k2 = 0;
    for (int z = 0; z < 8; ++z) most_k2 = std::max(most_k2, k2[z]);
    HeadPair<Row> heads;
    if (!profiled || most_k2 < kSmallDecay) {
      const Row thin = profiled ? k2 : Row{};  // without a profile k^2 may be anything
      const ProfileTerms<Row> profile{r, thinOneLessA<float>(thin), thinEven<float>(thin), Row{} + 1,
                                      Row{} + 1};
      const VoxelDrive<Row> drive{rho,
                                  scattering,
                                  lost,
                                  loadRow(block.share + n),
                                  gathered * rowOf(block.Q0, n),
                                  rowOf(block.Q, n),
                                  rowOf(block.flux, n),
                                  gathered * rowOf(block.lean, n),
                                  {gathered * rowOf(block.spread[0], n), gathered * rowOf(block.spread[1], n),
                                   gathered * rowOf(block.spread[2], n)},
                                  rowOf(profiled ? block.mean : nullptr, n)};
      heads = headsOf<kVaries, Row, float>(f, profile, drive);
    } else {
      for (int z = 0; z < 8; ++z) {
        double sigma_tr = e.optics.sigma_tr, sigma_a = e.optics.sigma_a;
        if constexpr (kVaries) {
          const ChannelOptics there = e.optics.where(block.albedo[n + z]);
          sigma_tr = there.sigma_tr;
          sigma_a = there.sigma_a;
        }
        const VoxelProfile p = e.profile(sigma_tr, sigma_a, rho[z]);
        const ProfileTerms<double> profile{p.r, 1 - p.a, p.even, p.lean, p.spread};
        const auto at = [&](const auto* field) { return field ? static_cast<double>(field[n + z]) : 0.0; };
        const VoxelDrive<double> drive{rho[z],
                                       scattering[z],
                                       lost[z],
                                       block.share[n + z],
                                       gathered[z] * at(block.Q0),
                                       at(block.Q),
                                       at(block.flux),
                                       gathered[z] * at(block.lean),
                                       {gathered[z] * at(block.spread[0]), gathered[z] * at(block.spread[1]),
                                        gathered[z] * at(block.spread[2])},
                                       at(block.mean)};
        const HeadPair<double> pair = headsOf<kVaries, double, double>(f, profile, drive);
        heads.upper[z] = static_cast<float>(pair.upper);
        heads.lower[z] = static_cast<float>(pair.lower);
      }
    }
    const RowMask on = rowMask(active[row]);
    storeRow(upper + n, on ? heads.upper : Row{});
    storeRow(lower + n, on ? heads.lower : Row{});
  }
}

VDB_DIFFUSE_KERNEL void headsOfBlock(const Equation& e, const HeadFactors& f, const BlockDrive& block,
                                     const uint8_t* active, float* upper, float* lower) {
  headsOfRows<false>(e, f, block, active, upper, lower);
}
VDB_DIFFUSE_KERNEL void headsOfVariedBlock(const Equation& e, const HeadFactors& f, const BlockDrive& block,
                                           const uint8_t* active, float* upper, float* lower) {
  headsOfRows<true>(e, f, block, active, upper, lower);
}

}  // namespace

void formFaceHeads(const Equation& e, const Medium& medium, const BeamSource& beams, const Field<double>* I0,
                   int axis, FaceHeads& heads) {
  const Topology& topology = *e.A->topology;
  HeadFactors f;
  f.axis = axis;
  f.s = e.stretch[axis];
  f.drive = 0.5 * f.s * beams.scale * e.optics.sigma_s * e.h * 3 * e.optics.g;
  f.scatters = beams.scale * e.optics.source_sigma * e.h;
  const double emission = beams.glow ? medium.optics.emission_scale : 0;
  f.glows = beams.scale * e.optics.sigma_a * e.h * emission;
  f.glows_lost = e.optics.albedo_field ? beams.scale * e.optics.true_sigma_s * e.h * emission : 0;
  f.shaped = beams.Q0 && e.settings.profile;
  if (heads.upper.empty()) heads.upper = heads.lower = Field<float>(topology);
  forEachBlock(topology.blockCount(), [&](size_t b) {
    const Shares shares(e.open[b]);
    BlockDrive block{};
    block.rho = medium.density.values.block(b);
    block.share = shares.along(axis);
    if (beams.Q0) block.Q0 = beams.Q0->block(b);
    if (beams.gathered) block.gathered = beams.gathered->block(b);
    if (e.optics.albedo_field) block.albedo = e.optics.albedo_field->block(b);
    if (emission != 0) block.Q = beams.glow->block(b);
    if (beams.Q1_flux) block.flux = (*beams.Q1_flux)[axis].block(b);
    if (beams.shape) {
      block.lean = beams.shape->lean[axis].block(b);
      for (int a = 0; a < 3; ++a) block.spread[a] = beams.shape->spread[a].block(b);
    }
    if (I0) block.mean = I0->block(b);
    const auto form = block.albedo ? headsOfVariedBlock : headsOfBlock;
    form(e, f, block, rowBits(topology.active(b)), heads.upper.block(b), heads.lower.block(b));
  });
}

}  // namespace vdb_diffuse
