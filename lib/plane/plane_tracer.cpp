#include "plane/plane_tracer.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

#include "reference/random.h"

namespace vdb_diffuse {
namespace {

constexpr int kBatches = 64;       // whose spread is the noise
constexpr double kRoulette = 0.1;  // paths lighter than this play for their lives

/// What one batch has seen, in powers of its paths.
struct Tally {
  PlaneField collisions, reflected, transmitted;
  double out_first = 0, out_last = 0, absorbed = 0, sideways = 0, unscattered = 0;
};

class Tracer {
 public:
  Tracer(const PlaneMedium& medium, const PlaneTracerSettings& settings)
      : m_(medium),
        settings_(settings),
        blocks_{medium.grid.nx / settings.block, medium.grid.ny / settings.block,
                medium.grid.h * settings.block} {
    const double densest = *std::max_element(m_.rho.begin(), m_.rho.end());
    majorant_ = m_.sigma_t() * densest;
    albedo_ = m_.sigma_s / m_.sigma_t();
    below_.assign(m_.irradiance.size() + 1, 0.0);
    std::partial_sum(m_.irradiance.begin(), m_.irradiance.end(), below_.begin() + 1);
  }

  PlaneTracerResult run() const {
    std::vector<Tally> tallies(kBatches);
    std::atomic<int> done{0};
    tbb::parallel_for(0, kBatches, [&](int batch) {
      tallies[batch] = trace(batch);
      if (settings_.progress) settings_.progress("paths", static_cast<double>(++done) / kBatches);
    });
    return summary(tallies);
  }

 private:
  const PlaneMedium& m_;
  const PlaneTracerSettings& settings_;
  const PlaneGrid blocks_;
  double majorant_ = 0, albedo_ = 1;
  std::vector<double> below_;  // sum of the irradiance of the columns before

  uint64_t pathsPerBatch() const { return std::max<uint64_t>(1, settings_.paths / kBatches); }

  Tally trace(int batch) const {
    constexpr uint64_t kBetweenLooks = 1 << 10;  // paths
    Tally tally;
    tally.collisions.assign(blocks_.count(), 0);
    tally.reflected.assign(blocks_.nx, 0);
    tally.transmitted.assign(blocks_.nx, 0);
    const uint64_t paths = pathsPerBatch();
    for (uint64_t n = 0; n < paths; ++n) {
      if (n % kBetweenLooks == 0 && settings_.progress) settings_.progress("paths", 0);
      RandomStream random(settings_.seed, static_cast<uint64_t>(batch), n);
      const double u =
          (static_cast<double>(n) + random.uniform()) / static_cast<double>(paths);  // stratified
      follow(entry(u), random, tally);
    }
    return tally;
  }

  double entry(double u) const {
    const double sum = u * below_.back();
    const auto after = std::upper_bound(below_.begin(), below_.end() - 1, sum);
    const size_t i = static_cast<size_t>(after - below_.begin()) - 1;
    return m_.grid.h * (static_cast<double>(i) + (sum - below_[i]) / m_.irradiance[i]);
  }

  void follow(double x, RandomStream& random, Tally& tally) const {
    const PlaneGrid& grid = m_.grid;
    const double width = grid.nx * grid.h, depth = grid.ny * grid.h;
    double y = 0, weight = 1;
    Vec3f direction(0, 1, 0);
    bool scattered = false;
    while (true) {
      const double flight = random.exponential() / majorant_;
      x += flight * direction[0];
      y += flight * direction[1];
      if (!(x >= 0 && x < width && y >= 0 && y < depth)) {
        leave(x, y, flight, direction, weight, scattered, tally);
        return;
      }
      const int i = std::min(static_cast<int>(x / grid.h), grid.nx - 1),
                j = std::min(static_cast<int>(y / grid.h), grid.ny - 1);
      if (scattered)
        tally.collisions[blocks_.at(i / settings_.block, j / settings_.block)] += weight / majorant_;
      if (random.uniform() * majorant_ >= m_.sigma_t() * m_.rho[grid.at(i, j)]) continue;
      tally.absorbed += weight * (1 - albedo_);
      weight *= albedo_;
      if (weight < kRoulette) {
        if (random.uniform() >= weight) {
          tally.absorbed += weight;
          return;
        }
        tally.absorbed -= 1 - weight;
        weight = 1;
      }
      direction = m_.g == 0 ? isotropicDirection(random) : deflected(direction, m_.g, random);
      scattered = true;
    }
  }

  /// Beyond which side: the one that was passed first.
  void leave(double x, double y, double flight, const Vec3f& direction, double weight, bool scattered,
             Tally& tally) const {
    const double width = m_.grid.nx * m_.grid.h, depth = m_.grid.ny * m_.grid.h;
    const double x0 = x - flight * direction[0], y0 = y - flight * direction[1];
    const double to_x = direction[0] > 0   ? (width - x0) / direction[0]
                        : direction[0] < 0 ? -x0 / direction[0]
                                           : HUGE_VAL;
    const double to_y = direction[1] > 0   ? (depth - y0) / direction[1]
                        : direction[1] < 0 ? -y0 / direction[1]
                                           : HUGE_VAL;
    if (!scattered) {
      tally.unscattered += weight;
    } else if (to_x < to_y) {
      tally.sideways += weight;
    } else {
      const int column =
          std::clamp(static_cast<int>((x0 + to_y * direction[0]) / blocks_.h), 0, blocks_.nx - 1);
      (direction[1] > 0 ? tally.transmitted : tally.reflected)[column] += weight;
      (direction[1] > 0 ? tally.out_last : tally.out_first) += weight;
    }
  }

  PlaneTracerResult summary(const std::vector<Tally>& tallies) const {
    const double per_path = 1.0 / static_cast<double>(pathsPerBatch());
    const double power = below_.back() * m_.grid.h;  // per length along the third axis
    const double intensity = power * per_path / (4 * M_PI * blocks_.h * blocks_.h);
    PlaneTracerResult result;
    result.grid = blocks_;
    const auto spread = [&](const auto& value, double factor, double& mean, double& error) {
      double sum = 0, squares = 0;
      for (const Tally& t : tallies) {
        const double v = factor * value(t);
        sum += v;
        squares += v * v;
      }
      mean = sum / kBatches;
      error = std::sqrt(std::max(0.0, squares / kBatches - mean * mean) / (kBatches - 1));
    };
    result.I0.resize(blocks_.count());
    result.I0_se.resize(blocks_.count());
    for (size_t c = 0; c < blocks_.count(); ++c)
      spread([&](const Tally& t) { return t.collisions[c]; }, intensity, result.I0[c], result.I0_se[c]);
    double unused;
    result.reflected.resize(blocks_.nx);
    result.transmitted.resize(blocks_.nx);
    const double flux = power * per_path / blocks_.h;
    for (int i = 0; i < blocks_.nx; ++i) {
      spread([&](const Tally& t) { return t.reflected[i]; }, flux, result.reflected[i], unused);
      spread([&](const Tally& t) { return t.transmitted[i]; }, flux, result.transmitted[i], unused);
    }
    spread([](const Tally& t) { return t.out_first; }, per_path, result.reflectance, result.reflectance_se);
    spread([](const Tally& t) { return t.out_last; }, per_path, result.transmittance,
           result.transmittance_se);
    spread([](const Tally& t) { return t.absorbed; }, per_path, result.absorbed, unused);
    spread([](const Tally& t) { return t.sideways; }, per_path, result.sideways, unused);
    spread([](const Tally& t) { return t.unscattered; }, per_path, result.unscattered, unused);
    return result;
  }
};

}  // namespace

double PlaneTracerResult::noise(const PlaneField& weight) const {
  double squares = 0, light = 0;
  for (size_t c = 0; c < I0.size(); ++c) {
    squares += weight[c] * I0_se[c] * I0_se[c];
    light += weight[c] * I0[c] * I0[c];
  }
  return light > 0 ? std::sqrt(squares / light) : 0;
}

PlaneTracerResult tracePlane(const PlaneMedium& medium, const PlaneTracerSettings& settings) {
  return Tracer(medium, settings).run();
}

}  // namespace vdb_diffuse
