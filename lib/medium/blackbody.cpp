#include "medium/blackbody.h"

#include <cmath>
#include <vector>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

/// A bell with another width on either side of its peak; wavelengths in nm.
double lobe(double lambda, double peak, double below, double above) {
  const double t = (lambda - peak) / (lambda < peak ? below : above);
  return std::exp(-0.5 * t * t);
}

Vec3d observer(double lambda) {  // nm
  return Vec3d(1.056 * lobe(lambda, 599.8, 37.9, 31.0) + 0.362 * lobe(lambda, 442.0, 16.0, 26.7) -
                   0.065 * lobe(lambda, 501.1, 20.4, 26.2),
               0.821 * lobe(lambda, 568.8, 46.9, 40.5) + 0.286 * lobe(lambda, 530.9, 16.3, 31.1),
               1.217 * lobe(lambda, 437.0, 11.8, 36.0) + 0.681 * lobe(lambda, 459.0, 26.0, 13.8));
}

/// W/m^3/sr; lambda in m.
double planck(double lambda, double kelvin) {
  constexpr double h = 6.62607015e-34, c = 299792458, k = 1.380649e-23;  // exact, SI of 2019
  return 2 * h * c * c / std::pow(lambda, 5) / std::expm1(h * c / (lambda * k * kelvin));
}

constexpr int kShortest = 360, kLongest = 830;  // nm

/// The responses at every nm.
const std::vector<Vec3d>& responses() {
  static const std::vector<Vec3d> table = [] {
    std::vector<Vec3d> all;
    for (int lambda = kShortest; lambda <= kLongest; ++lambda) all.push_back(observer(lambda));
    return all;
  }();
  return table;
}

Vec3d rgbOf(const Vec3d& xyz) {
  // IEC 61966-2-1.
  Vec3d rgb(3.2406 * xyz[0] - 1.5372 * xyz[1] - 0.4986 * xyz[2],
            -0.9689 * xyz[0] + 1.8758 * xyz[1] + 0.0415 * xyz[2],
            0.0557 * xyz[0] - 0.2040 * xyz[1] + 1.0570 * xyz[2]);
  for (int c = 0; c < 3; ++c) rgb[c] = std::max(rgb[c], 0.0);
  const double luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
  return luminance > 0 ? rgb * (xyz[1] / luminance) : Vec3d(0);
}

constexpr double kColdest = 500;  // a part in 1e14 of what a flame of 1500 K shows

/// Colours over the temperature, to be interpolated: its logarithm in equal steps, luminance by its
/// logarithm, the colour as shares of the luminance. Between entries the luminance is off by less than 1e-4.
class Table {
 public:
  explicit Table(double hottest) {
    for (double x = 0; hottest > kColdest && x < std::log(hottest / kColdest) + kStep; x += kStep) {
      const Vec3d xyz = blackbodyXyz(kColdest * std::exp(kStep * static_cast<double>(entries_.size())));
      entries_.push_back({std::log(xyz[1]), rgbOf(xyz) / xyz[1]});
    }
  }
  Vec3d at(double kelvin) const {
    if (!(kelvin >= kColdest) || entries_.size() < 2) return Vec3d(0);
    const double x = std::log(kelvin / kColdest) / kStep;
    const size_t n = std::min(static_cast<size_t>(x), entries_.size() - 2);
    const double t = std::min(x - static_cast<double>(n), 1.0);
    const Entry &a = entries_[n], &b = entries_[n + 1];
    return (a.colour * (1 - t) + b.colour * t) * std::exp(a.log_luminance * (1 - t) + b.log_luminance * t);
  }

 private:
  struct Entry {
    double log_luminance;
    Vec3d colour;
  };
  static constexpr double kStep = 1. / 256;
  std::vector<Entry> entries_;
};

}  // namespace

Vec3d blackbodyXyz(double kelvin) {
  if (!(kelvin > 0)) return Vec3d(0);
  Vec3d sum(0);
  for (int lambda = kShortest; lambda <= kLongest; ++lambda)
    sum += responses()[lambda - kShortest] * (planck(lambda * 1e-9, kelvin) * 1e-9);
  return sum;
}

Vec3d blackbodyRgb(double kelvin) {
  return rgbOf(blackbodyXyz(kelvin));
}

Channels blackbodyField(const Field<float>& temperature, double kelvin, double intensity) {
  double hottest = 0;
  for (size_t i = 0; i < temperature.size(); ++i) hottest = std::max(hottest, temperature[i] * kelvin);
  if (hottest > kHottest) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "the hottest voxel has %g K, above the %g K that are taken; what is a unit of the grid in "
                  "kelvin (temperature scale)?",
                  hottest, kHottest);
    throw InputError(text);
  }
  const Table table(hottest);
  Channels rgb(3, Field<float>(temperature.blockCount()));
  forEachBlock(temperature.blockCount(), [&](size_t b) {
    for (int n = 0; n < kBlockVoxels; ++n) {
      const Vec3d Q = table.at(temperature.block(b)[n] * kelvin) * intensity;
      for (int c = 0; c < 3; ++c) rgb[c].block(b)[n] = static_cast<float>(Q[c]);
    }
  });
  return rgb;
}

}  // namespace vdb_diffuse
