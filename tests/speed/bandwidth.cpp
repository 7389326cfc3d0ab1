#include "bandwidth.h"

#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>

#include "grid/aligned.h"
#include "stopwatch.h"

namespace vdb_diffuse::speed {
namespace {

constexpr int kPasses = 30;

/// Seconds of the fastest pass of body(begin, end) over 0..count; the first pass, which brings the pages in,
/// does not count.
template <typename Body>
double fastest(size_t count, const Body& body) {
  double best = 1e30;
  for (int pass = 0; pass <= kPasses; ++pass) {
    const Stopwatch watch;
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, count), [&](const auto& range) { body(range.begin(), range.end()); },
        tbb::static_partitioner());
    if (pass > 0) best = std::min(best, watch.read().wall);
  }
  return best;
}

template <typename T>
AlignedArray<T> filled(size_t count, T value) {
  AlignedArray<T> array = alignedArray<T>(count);
  std::fill_n(array.get(), count, value);
  return array;
}

}  // namespace

Bandwidth measureBandwidth(size_t megabytes) {
  Bandwidth result;
  const size_t bytes = megabytes << 20;
  {
    const size_t n = bytes / 3 / sizeof(double);
    const auto a_owner = filled(n, 1.0), b_owner = filled(n, 2.0), c_owner = filled(n, 0.5);
    double* __restrict a = a_owner.get(), * __restrict b = b_owner.get(), * __restrict c = c_owner.get();
    volatile double factor = 3;
    const double s = factor;
    const double copy = fastest(n, [=](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) c[i] = a[i];
    });
    const double triad = fastest(n, [=](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) a[i] = b[i] + s * c[i];
    });
    result.copy = 1e-9 * 2 * sizeof(double) * static_cast<double>(n) / copy;
    result.triad = 1e-9 * 3 * sizeof(double) * static_cast<double>(n) / triad;
  }
  const size_t n = bytes / 4 / sizeof(float);
  const auto a_owner = filled(n, 1.0f), b_owner = filled(n, 2.0f), c_owner = filled(n, 0.5f),
             d_owner = filled(n, 0.0f);
  float *__restrict a = a_owner.get(), *__restrict b = b_owner.get(), *__restrict c = c_owner.get(),
                    *__restrict d = d_owner.get();
  const double pass = fastest(n, [=](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) d[i] = a[i] + b[i] * c[i];
  });
  result.R = 1e9 * pass / static_cast<double>(n);
  return result;
}

}  // namespace vdb_diffuse::speed
