#include <cmath>

#include "grid/norms.h"
#include "paper/part.h"
#include "render/render.h"
#include "shapes/solids.h"

namespace vdb_diffuse {
namespace {

/// A block of constant density and light, seen through by the renderer along z; the pixel in its middle,
/// before a background of radiance 1.
double rendered(double tau, double albedo, double intensity) {
  LitVolume lit;
  constexpr int kSide = 16;
  lit.medium.density = makeBox({kSide * kSide * kSide, 1.0});
  lit.medium.optics.sigma_s = Vec3d(albedo * tau / kSide);
  lit.medium.optics.sigma_a = Vec3d((1 - albedo) * tau / kSide);
  lit.diffuse.emplace_back(lit.medium.topology(), static_cast<float>(intensity));
  CameraSettings view;
  view.width = view.height = 1;
  view.ortho = 0.1;
  view.look_at = Vec3d(0.1, 0.07, 0);
  view.from = Vec3d(0.1, 0.07, 100);
  view.up = Vec3d(0, 1, 0);
  RenderSettings settings;
  settings.interpolate = false;  // a block with sharp ends
  const Camera camera(view, outline(lit.medium.density));
  return over(render(lit, camera, settings), Vec3d(1)).pixels[0][0];
}

/// The same by summing small steps from front to back.
double marched(double tau, double albedo, double intensity, int steps) {
  double light = 0, through = 1;
  const double step = tau / steps;
  for (int n = 0; n < steps; ++n) {
    light += through * albedo * intensity * step / (1 + 0.5 * step);
    through *= (1 - 0.5 * step) / (1 + 0.5 * step);
  }
  return light + through;
}

}  // namespace

PaperResult compositing(const PaperSettings& settings) {
  constexpr double kIntensity = 0.4;
  Chart chart;
  chart.title = "Compositing through a constant slab (Stam 1995, 5.2)";
  chart.subtitle = "diffuse intensity " + number(kIntensity) + " before a background of 1";
  chart.x.label = "optical thickness";
  chart.x.scale = Scale::kLog;
  chart.y.label = "radiance (W/m²/sr)";
  chart.y.low = 0;
  chart.y.high = 1.05;
  Series formula{"τ I_back + (1 - τ) I", {}, {}, {}, false, {}, Marker::kNone, Stroke::kSolid, 6};
  Csv csv({"optical_thickness", "albedo", "formula", "rendered", "marched"});
  double conservative = 0, absorbing = 0, corrected = 0;
  int colour = 0;
  std::vector<Series> points;
  for (const double albedo : {1.0, 0.5}) {
    Series s{
        "rendered, albedo " + number(albedo), {}, {}, {}, false, {}, Marker::kDisc, Stroke::kNone, colour++};
    for (int n = -8; n <= 6; ++n) {
      if (settings.progress) settings.progress("compositing", (n + 8) / 15.0);
      const double thickness = std::pow(10.0, n / 4.0 - 0.25), tau = std::exp(-thickness);
      const double by_formula = tau + (1 - tau) * kIntensity, seen = rendered(thickness, albedo, kIntensity),
                   summed = marched(thickness, albedo, kIntensity, 20000);
      csv.row({number(thickness), number(albedo), number(by_formula), number(seen), number(summed)});
      s.x.push_back(thickness);
      s.y.push_back(seen);
      if (albedo == 1) {
        formula.x.push_back(thickness);
        formula.y.push_back(by_formula);
      }
      const double off = std::max(std::abs(by_formula - seen), std::abs(by_formula - summed));
      (albedo == 1 ? conservative : absorbing) = std::max(albedo == 1 ? conservative : absorbing, off);
      corrected = std::max(corrected, std::abs(tau + (1 - tau) * albedo * kIntensity - seen));
    }
    points.push_back(s);
  }
  chart.series = {formula, points[0], points[1]};
  PaperResult result;
  result.add("compositing", chart);
  result.files.emplace_back("compositing.csv", csv.text());
  result.claims = {{"compositing", "5.2", "compositing is right in a constant slab (albedo 1)",
                    "the largest difference, renderer and steps", Criterion::kAtMost, 1e-3, conservative, 1},
                   {"compositing", "5.2", "compositing as printed is right in a constant slab (albedo 0.5)",
                    "the largest difference, likewise", Criterion::kAtMost, 1e-3, absorbing, 1},
                   {"compositing", "5.2", "with the albedo before I it is right for both",
                    "the largest difference from the renderer", Criterion::kAtMost, 1e-3, corrected, 1}};
  return result;
}

}  // namespace vdb_diffuse
