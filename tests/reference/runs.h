#pragma once

#include <gtest/gtest.h>

#include "reference/path_tracer.h"
#include "volumes.h"

namespace vdb_diffuse {

/// A slab of `layers` voxels along z, 0 <= z <= depth, so wide that it has no sides; `rho` by layer.
inline Medium slabMedium(int layers, double depth, double width, const std::function<double(int)>& rho) {
  const double h = depth / layers;
  const Transform transform(Vec3d(width, 0, 0), Vec3d(0, width, 0), Vec3d(0, 0, h), Vec3d(0, 0, 0.5 * h));
  return boxMedium(Coord(1, 1, layers), transform, [&](Coord p) { return rho(p[2]); });
}

/// A pencil of light down along -z in the slab's middle.
inline Scene pencil(double z) {
  SpotLight spot;
  spot.position = Vec3d(0, 0, z);
  spot.direction = Vec3d(0, 0, -1);
  spot.angle = 1e-5;
  spot.intensity = Vec3d(1e10);
  Scene scene;
  scene.lights.push_back({"pencil", spot});
  return scene;
}

inline void setOptics(Medium& medium, double sigma_t, double albedo, double g = 0) {
  medium.optics.sigma_s = Vec3d(albedo * sigma_t);
  medium.optics.sigma_a = Vec3d((1 - albedo) * sigma_t);
  medium.optics.g = g;
}

inline ReferenceSettings paths(double samples, uint64_t seed = 1) {
  ReferenceSettings settings;
  settings.samples = static_cast<uint64_t>(samples);
  settings.seed = seed;
  return settings;
}

/// Mean over active voxels.
inline double meanOf(const Topology& topology, const Field<float>& values) {
  double sum = 0;
  forEachVoxel(topology, [&](Coord, size_t i) { sum += values[i]; });
  return sum / static_cast<double>(topology.activeVoxelCount());
}

/// A number of independent runs, and how far their average may be from the truth: a claim that fails by
/// chance once in some thousand.
struct Repeated {
  std::vector<double> values;

  double mean() const {
    double sum = 0;
    for (double v : values) sum += v;
    return sum / static_cast<double>(values.size());
  }
  double error() const {
    double sum = 0;
    for (double v : values) sum += (v - mean()) * (v - mean());
    const double n = static_cast<double>(values.size());
    return std::sqrt(sum / (n - 1) / n);
  }
};

inline void expectMean(const Repeated& runs, double truth, const std::string& what = "") {
  constexpr double kSigmas = 5;  // of Student's t with 7 degrees or more
  EXPECT_NEAR(runs.mean(), truth, kSigmas * runs.error() + 1e-6 * std::abs(truth))
      << what << " standard error " << runs.error();
}

}  // namespace vdb_diffuse
