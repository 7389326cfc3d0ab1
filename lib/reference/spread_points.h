#pragma once

#include "reference/random.h"

namespace vdb_diffuse {

/// Points of the unit square or the four-dimensional cube, drawn one from each of n equal pieces of a curve
/// that fills it (Morton order): each point is even by itself, all together are more even than chance, and
/// those drawn one after another are near each other, so that rays follow each other through memory. He and
/// Owen, "Extensible grids: uniform sampling on a space filling curve" (2016).
class SpreadPoints {
 public:
  SpreadPoints(int dimensions, uint64_t count) : dimensions_(dimensions), scale_(0x1p40 / count) {}

  /// Point number i < count as u[0..3]; where there are two dimensions, the others are random.
  void point(uint64_t i, RandomStream& random, double u[4]) const {
    const double along = (static_cast<double>(i) + random.uniform()) * scale_;
    const uint64_t bits = static_cast<uint64_t>(std::fmin(along, 0x1p40 - 1));
    if (dimensions_ == 2) {
      for (int a = 0; a < 2; ++a)
        u[a] = (static_cast<double>(everySecond(bits >> a)) + random.uniform()) * 0x1p-20;
      u[2] = random.uniform();
      u[3] = random.uniform();
    } else {
      for (int a = 0; a < 4; ++a)
        u[a] = (static_cast<double>(everySecond(everySecond(bits >> a))) + random.uniform()) * 0x1p-10;
    }
  }

 private:
  int dimensions_;
  double scale_;

  /// Bits 0, 2, 4, ... moved together.
  static uint64_t everySecond(uint64_t x) {
    x &= 0x5555555555555555ull;
    x = (x | x >> 1) & 0x3333333333333333ull;
    x = (x | x >> 2) & 0x0F0F0F0F0F0F0F0Full;
    x = (x | x >> 4) & 0x00FF00FF00FF00FFull;
    x = (x | x >> 8) & 0x0000FFFF0000FFFFull;
    return (x | x >> 16) & 0x00000000FFFFFFFFull;
  }
};

}  // namespace vdb_diffuse
