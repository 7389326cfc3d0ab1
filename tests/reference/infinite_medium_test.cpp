#include "reference/runs.h"

namespace vdb_diffuse {
namespace {

/// Fluence at r mean free paths from a point that emits 1 W in an unbounded medium that scatters
/// isotropically with albedo c; Case, de Hoffmann and Placzek, "Introduction to the Theory of Neutron
/// Diffusion" (1953). A pole, the diffusing light, and a branch cut, which holds the uncollided light:
///
///     2 k^2 (1 - k^2) / (c (k^2 - 1 + c)) exp(-k r) / (4 pi r)  +  1/(4 pi r) int_0^1 G(v) exp(-r/v) dv/v^2
///
/// with c atanh(k) = k and 1/G = (1 - c v atanh v)^2 + (pi c v / 2)^2.
class PointLamp {
 public:
  explicit PointLamp(double c) : c_(c) {
    double low = 1e-9, high = 1 - 1e-15;
    for (int n = 0; n < 200; ++n) {
      const double k = 0.5 * (low + high);
      (c * std::atanh(k) < k ? low : high) = k;
    }
    k_ = low;
  }
  double fluence(double r) const {
    const double pole = 2 * k_ * k_ * (1 - k_ * k_) / (c_ * (k_ * k_ - 1 + c_)) * std::exp(-k_ * r);
    constexpr int kSteps = 1000;  // 1/v = 1 + s/(1-s): the integrand vanishes smoothly at both ends
    double cut = 0;
    for (int n = 0; n < kSteps; ++n) {
      const double s = (n + 0.5) / kSteps, inverse = 1 + s / (1 - s), v = 1 / inverse;
      const double a = 1 - c_ * v * std::atanh(v), b = 0.5 * M_PI * c_ * v;
      cut += std::exp(-r * inverse) / (a * a + b * b) / ((1 - s) * (1 - s)) / kSteps;  // dv/v^2 = d(1/v)
    }
    return (pole + cut) / (4 * M_PI * r);
  }

 private:
  double c_, k_;
};

// All that is emitted is absorbed: (1 - c) int 4 pi r^2 fluence dr = 1.
TEST(PointLampFormula, AbsorbsWhatItEmits) {
  for (double c : {0.3, 0.7, 0.9}) {
    const PointLamp lamp(c);
    double sum = 0;
    constexpr double kStep = 0.04;
    for (double r = 0.5 * kStep; r < 60; r += kStep) sum += 4 * M_PI * r * r * lamp.fluence(r) * kStep;
    EXPECT_NEAR((1 - c) * sum, 1, 1e-3) << c;
  }
}

// A lamp in the middle of a box so large that what its sides let out does not show: exp(-9 k), k = 0.71 at
// albedo .8. Shells of voxels, scattered light only.
TEST(ReferenceInfiniteMedium, PointLampIsPolePlusBranchCut) {
  constexpr int kHalf = 18;
  constexpr double kH = 0.5, kAlbedo = 0.8;
  Medium medium = boxMedium(
      Coord(2 * kHalf), Transform::uniform(kH, Vec3d(0.5 * kH)), [](Coord) { return 1.0; }, Coord(-kHalf));
  setOptics(medium, 1, kAlbedo);
  Scene scene;
  scene.lights.push_back({"lamp", PointLight{Vec3d(0.02, 0.01, -0.03), Vec3d(1 / (4 * M_PI)), 0}});
  constexpr int kShells = 10;
  Repeated shell[kShells];
  double expected[kShells] = {};
  const PointLamp lamp(kAlbedo);
  std::vector<double> scattered;  // by r in steps of 1/100
  for (int n = 0; n < 1000; ++n) {
    const double r = (n + 0.5) / 100;
    scattered.push_back(lamp.fluence(r) - std::exp(-r) / (4 * M_PI * r * r));
  }
  const auto shellOf = [&](Coord p) {
    return static_cast<int>((p.asVec3d() + Vec3d(0.5)).length() * kH * 2);
  };
  forEachVoxel(medium.topology(), [&](Coord p, size_t) {
    if (shellOf(p) >= kShells) return;
    constexpr int kParts = 4;
    for (int s = 0; s < kParts * kParts * kParts; ++s) {
      const Vec3d within(s % kParts, s / kParts % kParts, s / (kParts * kParts));
      const Vec3d at = (p.asVec3d() + (within + Vec3d(0.5)) / kParts) * kH - Vec3d(0.02, 0.01, -0.03);
      expected[shellOf(p)] += scattered[static_cast<int>(at.length() * 100)] / (kParts * kParts * kParts);
    }
  });
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    const ReferenceResult result = reference(medium, scene, paths(2e4, seed));
    double sum[kShells] = {};
    forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
      if (shellOf(p) < kShells) sum[shellOf(p)] += 4 * M_PI * result.diffuse[0][i];
    });
    for (int s = 0; s < kShells; ++s) shell[s].values.push_back(sum[s] / expected[s]);
  }
  for (int s = 1; s < kShells; ++s) {  // within the innermost voxels the formula is too steep for four points
    // Steps of 1/100 and points of 1/8 leave some thousandths.
    EXPECT_NEAR(shell[s].mean(), 1, 5 * shell[s].error() + 0.003) << "shell " << s;
    EXPECT_LT(shell[s].error(), 0.01);
  }
}

}  // namespace
}  // namespace vdb_diffuse
