#include "plane/plane_tracer.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "plane/plane_media.h"

namespace vdb_diffuse {
namespace {

// van de Hulst (1980), table 35, as tests/reference/slab_test.cpp has it: Henyey-Greenstein, g 0.75, albedo
// 0.9, depth 2, normal incidence.
TEST(PlaneTracer, ReflectsAndTransmitsAsVanDeHulst) {
  const PlaneMedium m = layerMedium(512, 16, 2, 0.9, 0.75, 248, 264);
  const PlaneTracerResult r = tracePlane(m, {1 << 19, 8, 3, {}});
  EXPECT_LT(r.reflectance_se, 4e-3 * r.reflectance);
  EXPECT_NEAR(r.reflectance, 0.09739, 4 * r.reflectance_se);
  EXPECT_NEAR(r.transmittance + std::exp(-2), 0.66096, 4 * r.transmittance_se);
  EXPECT_NEAR(r.unscattered, std::exp(-2), 2e-3);
  EXPECT_LT(r.sideways, 1e-4);
}

/// Density that grows to the right and down, to be told from its mirror image.
PlaneMedium slantedMedium() {
  PlaneMedium m = layerMedium(64, 64, 6, 0.8, 0.4, 8, 40);
  for (int j = 0; j < 64; ++j)
    for (int i = 0; i < 64; ++i) m.rho[m.grid.at(i, j)] = 0.2 + (i + 2.0 * j) / 128;
  return m;
}

TEST(PlaneTracer, PowerIsAccountedForAndAbsorptionIsTheLights) {
  const PlaneMedium m = slantedMedium();
  const PlaneTracerResult r = tracePlane(m, {1 << 18, 8, 1, {}});
  EXPECT_NEAR(r.reflectance + r.transmittance + r.absorbed + r.sideways + r.unscattered, 1, 1e-9);
  // What is absorbed is 4 pi sigma_a rho times the light, scattered or not.
  const PlaneField Q0 = directLight(m), rho = blockMeans(m.grid, m.rho, 8);
  double power = 0, absorbed = 0;
  for (const double e : m.irradiance) power += e * m.grid.h;
  for (size_t c = 0; c < Q0.size(); ++c)
    absorbed += 4 * M_PI * m.sigma_a * m.rho[c] * Q0[c] * m.grid.h * m.grid.h;
  for (size_t c = 0; c < r.I0.size(); ++c)
    absorbed += 4 * M_PI * m.sigma_a * rho[c] * r.I0[c] * r.grid.h * r.grid.h;
  EXPECT_NEAR(absorbed / power, r.absorbed, 5e-3 * r.absorbed);
}

TEST(PlaneTracer, ThreadsDoNotShow) {
  const PlaneMedium m = slantedMedium();
  std::vector<PlaneField> I0;
  for (const size_t threads : {1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    I0.push_back(tracePlane(m, {1 << 12, 8, 1, {}}).I0);
  }
  EXPECT_EQ(I0[0], I0[1]);
}

}  // namespace
}  // namespace vdb_diffuse
