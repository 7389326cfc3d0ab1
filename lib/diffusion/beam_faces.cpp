#include "diffusion/beam_faces.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace vdb_diffuse {
namespace {

/// Factors of 1, t, t^2 ..
using Polynomial = std::array<double, 5>;

Polynomial operator*(const Polynomial& p, const Polynomial& q) {
  Polynomial product{};
  for (size_t i = 0; i < p.size(); ++i)
    for (size_t j = 0; i + j < p.size(); ++j) product[i + j] += p[i] * q[j];
  return product;
}

/// Factors of (1 - t)^k / k!.
Polynomial fromTheEnd(const Polynomial& p) {
  Polynomial sum{}, power{1};  // of t = 1 - (1 - t)
  for (const double factor : p) {
    for (size_t k = 0; k < sum.size(); ++k) sum[k] += factor * power[k];
    power = power * Polynomial{1, -1};
  }
  double factorial = 1;
  for (size_t k = 1; k < sum.size(); ++k) sum[k] *= factorial *= static_cast<double>(k);
  return sum;
}

}  // namespace

BeamFaces::BeamFaces(const Vec3d& s, const Vec3d& stretch, double extinction) {
  Vec3d speed;
  for (int a = 0; a < 3; ++a) {
    speed[a] = std::abs(s[a]) / stretch[a];
    sign_[a] = s[a] < 0 ? -1 : 1;
  }
  const double fastest = std::max({speed[0], speed[1], speed[2]});
  speed /= fastest;
  for (int a = 0; a < 3; ++a) speed_[a] = static_cast<float>(speed[a]);
  depth_per_density_ = static_cast<float>(extinction / fastest);
  for (int a = 0; a < 3; ++a) {
    Polynomial stays{speed[a]};  // through a face comes as much light as the beam is steep to it
    for (const int b : {(a + 1) % 3, (a + 2) % 3}) stays = stays * Polynomial{1, -speed[b]};
    for (auto& power : stays_[a]) {
      const Polynomial q = fromTheEnd(stays);
      for (size_t k = 0; k < q.size(); ++k) power[k] = static_cast<float>(q[k]);
      stays = stays * Polynomial{0, 1};
    }
  }
}

namespace {

template <bool kReplace>
VDB_DIFFUSE_INLINE void placeInRows(const BeamFaces& faces, const Halo<float>& rho,
                                    const BlockMoments& block) {
  const auto add = [](float* to, Row keeps, Row more) VDB_DIFFUSE_INLINED {
    storeRow(to, (kReplace ? loadRow(to) * keeps : loadRow(to)) + more);
  };
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      const Row density = loadRow(rho.row(x, y)), share = faces.share(density);
      if (!anyOf(share > 0.0f)) continue;
      const int at = voxelOffset(x, y, 0);
      const Row before[3] = {
          loadRow(rho.row(x + (faces.fromAbove(0) ? 1 : -1), y)),
          loadRow(rho.row(x, y + (faces.fromAbove(1) ? 1 : -1))),
          faces.fromAbove(2) ? shiftedDown(density, rho.above[x][y]) : shiftedUp(density, rho.below[x][y])};
      const BeamFaces::Moments moments = faces.moments(density, before);
      const Row light = loadRow(block.light + at), placed = kReplace ? share * light : light;
      for (int a = 0; a < 3; ++a) {
        add(block.lean[a] + at, 1.0f - share, placed * moments.lean[a]);
        add(block.spread[a] + at, 1.0f - share, placed * moments.spread[a]);
      }
    }
}

}  // namespace

VDB_DIFFUSE_KERNEL void replaceMoments(const BeamFaces& faces, const Halo<float>& rho,
                                       const BlockMoments& block) {
  placeInRows<true>(faces, rho, block);
}

VDB_DIFFUSE_KERNEL void addMoments(const BeamFaces& faces, const Halo<float>& rho,
                                   const BlockMoments& block) {
  placeInRows<false>(faces, rho, block);
}

}  // namespace vdb_diffuse
