#include "diffusion/beam_faces.h"

#include <gtest/gtest.h>

#include "diffusion/first_scatter.h"
#include "diffusion/source_shape.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

FirstScatter shaped(const Medium& medium, const Scene& scene, bool exact_march = false) {
  FirstScatterSettings settings;
  settings.want_shape = true;
  settings.exact_march = exact_march;
  return firstScatter(medium, scene, Occluder({}), Model::kDefault, settings);
}

// Below a flat face light falls as exp(-tau z / mu), and aslant it is even. Here in every voxel by itself,
// whatever its rays; what is left out is of the order 1 / tau^2.
TEST(BeamFaces, BelowAFlatFaceVoxelsHoldTheDecay) {
  constexpr int kWidth = 14;
  for (double depth : {15.0, 100.0, 1e4})
    for (const Vec3d& d : {Vec3d(0, 0, -1), Vec3d(0.3, 0.2, -1), Vec3d(1, -0.4, -0.8), Vec3d(0.2, 1, -0.4)})
      for (bool exact_march : {false, true}) {
        Medium medium = boxMedium(Coord(kWidth, kWidth, 3), Transform::uniform(1), [](Coord) { return 1.0; });
        medium.optics.sigma_s = Vec3d(depth);
        const FirstScatter light = shaped(medium, sunScene(d), exact_march);
        const double tau = depth / std::abs(d.unit()[2]), left_out = 6 / (tau * tau) + 1e-6;
        const DecayMoments decay = decayMoments(tau);
        const double lean = 0.5 - decay.m1 / decay.m0,
                     spread = 0.25 - decay.m1 / decay.m0 + decay.m2 / decay.m0 - 1. / 12;
        for (int n = 0; n < 64; ++n) {
          const Coord p(3 + n / 8, 3 + n % 8, 2);
          const double mean = light.direct[0].at(medium.topology(), p);
          for (int a = 0; a < 3; ++a) {
            EXPECT_NEAR(light.shape[0].lean[a].at(medium.topology(), p) / mean, a == 2 ? lean : 0, left_out)
                << d << " depth " << depth << " axis " << a << " at " << p;
            EXPECT_NEAR(light.shape[0].spread[a].at(medium.topology(), p) / mean, a == 2 ? spread : 0,
                        left_out)
                << d << " depth " << depth << " axis " << a << " at " << p;
          }
        }
      }
}

/// Moments of light that comes evenly through the faces toward it, by many chords of the voxel; each along
/// the axis by which it comes.
void countChords(const Vec3d& d, double extinction, double lean[3], double spread[3]) {
  constexpr int kSteps = 60;
  double light = 0;
  for (int a = 0; a < 3; ++a) lean[a] = spread[a] = 0;
  for (int face = 0; face < 3; ++face)
    for (int n = 0; n < kSteps * kSteps; ++n) {
      Vec3d p(0);
      p[face] = d[face] > 0 ? -0.5 : 0.5;
      p[(face + 1) % 3] = (n % kSteps + 0.5) / kSteps - 0.5;
      p[(face + 2) % 3] = (n / kSteps + 0.5) / kSteps - 0.5;
      double chord = 1e9;
      for (int a = 0; a < 3; ++a) chord = std::min(chord, ((d[a] > 0 ? 0.5 : -0.5) - p[a]) / d[a]);
      const DecayMoments decay = decayMoments(extinction * chord);
      const double part = std::abs(d[face]) * chord;
      light += part * decay.m0;
      const double x = p[face], step = d[face] * chord;
      lean[face] += part * (x * decay.m0 + step * decay.m1);
      spread[face] +=
          part * ((x * x - 1. / 12) * decay.m0 + 2 * x * step * decay.m1 + step * step * decay.m2);
    }
  for (int a = 0; a < 3; ++a) {
    lean[a] /= light;
    spread[a] /= light;
  }
}

TEST(BeamFaces, AVoxelByItselfHoldsWhatItsChordsDo) {
  for (const Vec3d& direction : {Vec3d(0.3, 0.2, -1), Vec3d(1, -0.7, -0.8), Vec3d(-0.1, 1, 0.4)})
    for (double extinction : {4.0, 20.0, 1e3}) {
      const Vec3d d = direction.unit();
      const BeamFaces faces(d, Vec3d(1), extinction);
      const Row nothing[3] = {};
      const BeamFaces::Moments moments = faces.moments(Row{} + 1, nothing);
      double lean[3], spread[3];
      countChords(d, extinction, lean, spread);
      for (int a = 0; a < 3; ++a) {
        EXPECT_NEAR(moments.lean[a][0], lean[a], 1e-3) << d << " " << extinction << " axis " << a;
        EXPECT_NEAR(moments.spread[a][0], spread[a], 1e-3) << d << " " << extinction << " axis " << a;
      }
    }
}

// What a lamp sends into an opaque box is its intensity times the solid angle of the face that it sees.
TEST(LightMarch, OpaqueVoxelsScatterAllOfALampsLight) {
  constexpr double kHalf = 5, kAbove = 9;
  for (double depth : {8.0, 50.0, 1e4}) {
    Medium medium = boxMedium(Coord(10, 10, 3), Transform::uniform(1), [](Coord) { return 1.0; });
    medium.optics.sigma_s = Vec3d(depth);
    Scene lamp;
    lamp.lights.push_back({"lamp", PointLight{Vec3d(4.5, 4.5, 2.5 + kAbove), Vec3d(7), 0}});
    const FirstScatter light = shaped(medium, lamp);
    double scattered = 0;
    forEachVoxel(medium.topology(),
                 [&](Coord, size_t i) { scattered += 4 * M_PI * depth * light.direct[0][i]; });
    const double solid_angle =
        4 * std::atan(kHalf * kHalf / (kAbove * std::sqrt(2 * kHalf * kHalf + kAbove * kAbove)));
    // few points on a face tell what leaves by a side the worse, the less of it stays near the edge
    EXPECT_NEAR(scattered, 7 * solid_angle, (0.001 + 0.15 / depth) * 7 * solid_angle) << depth;
  }
}

}  // namespace
}  // namespace vdb_diffuse
