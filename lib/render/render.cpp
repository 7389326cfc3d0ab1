#include "render/render.h"

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "grid/ray_march.h"
#include "render/dual_cells.h"

namespace vdb_diffuse {
namespace {

constexpr double kOpaque = 1e-4;  // what lies behind changes the pixel by less than a quarter of a PNG's step

/// (1 - e^-x)/x, the mean transmittance along an optical depth x >= 0.
double meanTransmittance(double x) {
  constexpr double kThin = 0.02;  // the series is off by x^4/120 there
  return x < kThin ? 1 - x / 2 * (1 - x / 3 * (1 - x / 4)) : -std::expm1(-x) / x;
}

/// What a ray has gathered so far.
template <int kChannels>
struct Gathered {
  double radiance[kChannels] = {};
  double transmittance[kChannels];

  Gathered() { std::fill_n(transmittance, kChannels, 1.0); }
  /// A stretch of constant density and emission.
  void add(const VoxelLight<kChannels>& voxel, const double* sigma_t, double length) {
    for (int c = 0; c < kChannels; ++c) {
      const double tau = sigma_t[c] * voxel.rho * length;
      const double mean = meanTransmittance(tau);
      radiance[c] += transmittance[c] * voxel.emitted[c] * length * mean;
      transmittance[c] *= 1 - tau * mean;  // e^-tau
    }
  }
  bool opaque() const { return *std::max_element(transmittance, transmittance + kChannels) < kOpaque; }
};

template <int kChannels>
VoxelLight<kChannels> mix(const VoxelLight<kChannels>& a, const VoxelLight<kChannels>& b, float f) {
  VoxelLight<kChannels> v;
  v.rho = a.rho + f * (b.rho - a.rho);
  for (int c = 0; c < kChannels; ++c) v.emitted[c] = a.emitted[c] + f * (b.emitted[c] - a.emitted[c]);
  return v;
}

/// The eight corners of a cell, index 4x+2y+z.
template <int kChannels>
struct Cell {
  VoxelLight<kChannels> corner[8];

  double densest() const {
    float rho = corner[0].rho;
    for (int i = 1; i < 8; ++i) rho = std::max(rho, corner[i].rho);
    return rho;
  }
  VoxelLight<kChannels> at(const Vec3d& p_cell) const {
    const float x = std::clamp(static_cast<float>(p_cell[0]), 0.0f, 1.0f);
    const float y = std::clamp(static_cast<float>(p_cell[1]), 0.0f, 1.0f);
    const float z = std::clamp(static_cast<float>(p_cell[2]), 0.0f, 1.0f);
    const auto face = [&](const VoxelLight<kChannels>* c) {
      return mix(mix(c[0], c[1], z), mix(c[2], c[3], z), y);
    };
    return mix(face(corner), face(corner + 4), x);
  }
};

template <int kChannels>
class Renderer {
 public:
  Renderer(const LitVolume& lit, const Camera& camera, const RenderSettings& settings)
      : medium_(lit.medium),
        camera_(camera),
        settings_(settings),
        light_(emittedToward<kChannels>(camera, lit)) {
    const Vec3d sigma_t = medium_.optics.sigmaT();
    for (int c = 0; c < kChannels; ++c) sigma_t_[c] = sigma_t[c];
    densest_sigma_ = *std::max_element(sigma_t_, sigma_t_ + kChannels);
    if (settings.interpolate) dual_ = dualCells(medium_.topology());
  }

  void pixel(int x, int y, Vec3f& radiance, Vec3f& transmittance) const {
    const int n = settings_.samples;
    Vec3d sum(0), through(0);
    for (int s = 0; s < n * n; ++s) {
      const double dx = (s % n + jitter(x, y, 2 * s)) / n, dy = (s / n + jitter(x, y, 2 * s + 1)) / n;
      const Ray ray = camera_.ray(x + dx, y + dy);
      const Gathered<kChannels> gathered = settings_.interpolate ? throughCells(ray) : throughVoxels(ray);
      for (int c = 0; c < 3; ++c) {
        sum[c] += gathered.radiance[kChannels == 1 ? 0 : c];
        through[c] += gathered.transmittance[kChannels == 1 ? 0 : c];
      }
    }
    radiance = Vec3f(sum / (n * n));
    transmittance = Vec3f(through / (n * n));
  }

 private:
  /// A fixed number in 0..1 for a pixel and a sample; one sample per pixel goes through its middle.
  double jitter(int x, int y, int sample) const {
    if (settings_.samples == 1) return 0.5;
    uint64_t h = settings_.seed + 0x9e3779b97f4a7c15ull * static_cast<uint64_t>(sample + 1);
    for (const uint64_t word : {static_cast<uint64_t>(x), static_cast<uint64_t>(y)}) {
      h = (h ^ word) * 0xbf58476d1ce4e5b9ull;  // the finaliser of splitmix64
      h = (h ^ (h >> 27)) * 0x94d049bb133111ebull;
      h ^= h >> 31;
    }
    return static_cast<double>(h >> 11) * 0x1p-53;
  }

  Gathered<kChannels> throughVoxels(const Ray& ray) const {
    const Vec3d p = medium_.transform().toIndex(ray.origin),
                d = medium_.transform().directionToIndex(ray.direction);
    Gathered<kChannels> gathered;
    marchRay(medium_.topology(), p, d, ray.t_min, std::numeric_limits<double>::infinity(),
             [&](size_t block, int voxel, double t0, double t1) {
               const VoxelLight<kChannels>& light = light_.block(block)[voxel];
               if (light.rho > 0) gathered.add(light, sigma_t_, t1 - t0);
               return !gathered.opaque();
             });
    return gathered;
  }

  Gathered<kChannels> throughCells(const Ray& ray) const {
    const Vec3d half(0.5);  // the march has cell i about i, here it begins at voxel centre i
    const Vec3d p = medium_.transform().toIndex(ray.origin) - half;
    const Vec3d d = medium_.transform().directionToIndex(ray.direction);
    Gathered<kChannels> gathered;
    marchRay(dual_.cells, p, d, ray.t_min, std::numeric_limits<double>::infinity(),
             [&](size_t block, int n, double t0, double t1) {
               if (!dual_.cells.active(block).isOn(n)) return true;
               const Cell<kChannels> cell = cellAt(block, n);
               const Vec3d origin = (dual_.cells.origin(block) + voxelLocal(n)).asVec3d() - half;
               addCell(cell, p - origin, d, t0, t1, gathered);
               return !gathered.opaque();
             });
    return gathered;
  }

  Cell<kChannels> cellAt(size_t block, int n) const {
    const std::array<int32_t, 8>& blocks = dual_.voxel_blocks[block];
    const Coord c = voxelLocal(n);
    Cell<kChannels> cell;
    for (int i = 0; i < 8; ++i) {
      const int x = c[0] + (i >> 2), y = c[1] + ((i >> 1) & 1), z = c[2] + (i & 1);
      const int32_t b = blocks[(x >> 3) * 4 + (y >> 3) * 2 + (z >> 3)];
      cell.corner[i] =
          b == kNoBlock ? VoxelLight<kChannels>{} : light_.block(b)[voxelOffset(x & 7, y & 7, z & 7)];
    }
    return cell;
  }

  void addCell(const Cell<kChannels>& cell, const Vec3d& p, const Vec3d& d, double t0, double t1,
               Gathered<kChannels>& gathered) const {
    constexpr double kGauss = 0.21132486540518711775;  // (1 - 1/sqrt(3))/2
    constexpr double kStepDepth =
        0.5;  // optical depth of a step: the source varies over it by less than it decays
    constexpr int kMostSteps = 16;  // for voxels so thick that the light comes from their surface anyway
    const double densest = cell.densest();
    if (!(densest > 0)) return;
    const int steps = static_cast<int>(std::clamp(
        std::ceil(densest * densest_sigma_ * (t1 - t0) / kStepDepth), 1.0, static_cast<double>(kMostSteps)));
    const double length = (t1 - t0) / steps;
    for (int s = 0; s < steps; ++s) {
      const double t = t0 + s * length;
      gathered.add(cell.at(p + d * (t + kGauss * length)), sigma_t_, length / 2);
      gathered.add(cell.at(p + d * (t + (1 - kGauss) * length)), sigma_t_, length / 2);
    }
  }

  const Medium& medium_;
  const Camera& camera_;
  const RenderSettings& settings_;
  Field<VoxelLight<kChannels>> light_;
  DualCells dual_;
  double sigma_t_[kChannels];
  double densest_sigma_;
};

template <int kChannels>
Picture renderChannels(const LitVolume& lit, const Camera& camera, const RenderSettings& settings,
                       const Progress& progress) {
  const Renderer<kChannels> renderer(lit, camera, settings);
  const int width = camera.width(), height = camera.height();
  Picture picture;
  picture.radiance.width = width;
  picture.radiance.height = height;
  picture.radiance.pixels.resize(static_cast<size_t>(width) * height);
  picture.transmittance.resize(picture.radiance.pixels.size());
  constexpr int kTile = 16;
  std::atomic<size_t> done{0};
  const tbb::blocked_range2d<int> pixels(0, height, kTile, 0, width, kTile);
  tbb::parallel_for(pixels, [&](const tbb::blocked_range2d<int>& tile) {
    for (int y = tile.rows().begin(); y < tile.rows().end(); ++y)
      for (int x = tile.cols().begin(); x < tile.cols().end(); ++x) {
        const size_t i = static_cast<size_t>(y) * width + x;
        renderer.pixel(x, y, picture.radiance.pixels[i], picture.transmittance[i]);
      }
    const size_t count = done += tile.rows().size() * tile.cols().size();
    if (progress) progress("render", static_cast<double>(count) / picture.transmittance.size());
  });
  return picture;
}

}  // namespace

Picture render(const LitVolume& lit, const Camera& camera, const RenderSettings& settings,
               const Progress& progress) {
  return grey(lit) ? renderChannels<1>(lit, camera, settings, progress)
                   : renderChannels<3>(lit, camera, settings, progress);
}

}  // namespace vdb_diffuse
