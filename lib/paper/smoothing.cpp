#include <cmath>

#include "grid/parallel.h"
#include "paper/part.h"
#include "reference/random.h"

namespace vdb_diffuse {
namespace {

constexpr int kOrders = 12;  // of scattering

/// Sums over paths of the Legendre polynomials P1 to P3 of the cosine between the way light came and the way
/// it goes after n scatterings.
struct Moments {
  double sum[kOrders + 1][3] = {};
  void operator+=(const Moments& o) {
    for (int n = 0; n <= kOrders; ++n)
      for (int l = 0; l < 3; ++l) sum[n][l] += o.sum[n][l];
  }
};

Moments scattered(double g, size_t batches, size_t paths) {
  return sumOverBlocks<Moments>(
      batches,
      [&](size_t batch) {
        Moments m;
        for (size_t p = 0; p < paths; ++p) {
          RandomStream random(1, batch, p);
          Vec3f s(0, 0, 1);
          for (int n = 0; n <= kOrders; ++n) {
            const double c = s[2];
            m.sum[n][0] += c;
            m.sum[n][1] += 0.5 * (3 * c * c - 1);
            m.sum[n][2] += 0.5 * (5 * c * c - 3) * c;
            s = deflected(s, g, random);
          }
        }
        return m;
      },
      1);
}

}  // namespace

PaperResult angularSmoothing(const PaperSettings& settings) {
  constexpr double kG = 0.75;
  constexpr size_t kBatches = 64;
  const size_t paths = std::max<size_t>(16, static_cast<size_t>(settings.effort * 4096));
  if (settings.progress) settings.progress("smoothing", 0);
  const Moments m = scattered(kG, kBatches, paths);
  const double count = static_cast<double>(kBatches * paths);
  Chart chart;
  chart.title = "Scattering smooths the light (Stam 1995, appendix A)";
  chart.subtitle =
      "coefficients of its dependence on direction after n scatterings; Henyey-Greenstein, g = 0.75; lines: "
      "(p_l/4π)ⁿ, p_l = 4π gˡ";
  chart.x.label = "scatterings n";
  chart.y.label = "coefficient over its first value";
  chart.x.low = -0.3;
  chart.y.low = 0;
  chart.y.high = 1.05;
  Csv csv({"scatterings", "l", "measured", "power_of_p_l"});
  double off = 0;
  for (int l = 0; l < 3; ++l) {
    Series law{"", {}, {}, {}, false, {}, Marker::kNone, Stroke::kSolid, l};
    Series seen{"l = " + std::to_string(l + 1), {}, {}, {}, false, {}, Marker::kDisc, Stroke::kNone, l};
    for (int n = 0; n <= kOrders; ++n) {
      const double expected = std::pow(kG, n * (l + 1)), measured = m.sum[n][l] / count;
      csv.row({std::to_string(n), std::to_string(l + 1), number(measured), number(expected)});
      law.x.push_back(n), law.y.push_back(expected);
      seen.x.push_back(n), seen.y.push_back(measured);
      off = std::max(off, std::abs(measured - expected));
    }
    chart.series.push_back(law);
    chart.series.push_back(seen);
  }
  PaperResult result;
  result.add("smoothing", chart);
  result.files.emplace_back("smoothing.csv", csv.text());
  const double noise = 4 / std::sqrt(count);
  result.claims = {
      {"smoothing", "A", "n scatterings multiply a coefficient by (p_l/4 pi)^n", "the largest difference",
       Criterion::kAtMost, noise, off, 1},
      {"smoothing", "A", "p_1 = 2 pi mu_bar/3 as printed", "4 pi x the mean cosine, by Monte Carlo",
       Criterion::kEqual, 2 * M_PI * 3 * kG / 3, 4 * M_PI * m.sum[1][0] / count, 1}};
  return result;
}

}  // namespace vdb_diffuse
