#include <algorithm>
#include <cmath>

#include "paper/part.h"
#include "plane/plane_tracer.h"
#include "plane/v_cycle.h"

namespace vdb_diffuse {
namespace {

constexpr int kAcross = 512, kDeep = 64, kBlock = 8;

/// A layer of this optical thickness, eight times as wide, lit over the middle eighth of its width.
PlaneMedium layer(double tau, double albedo, double g) {
  PlaneMedium m;
  m.grid = {kAcross, kDeep, 1.0 / kDeep};
  m.rho.assign(m.grid.count(), 1.0);
  m.sigma_s = albedo * tau;
  m.sigma_a = (1 - albedo) * tau;
  m.g = g;
  for (int i = 0; i < kAcross; ++i)
    m.irradiance.push_back(std::abs((i + 0.5) / kAcross - 0.5) < 1.0 / 16 ? 1 : 0);
  return m;
}

double shareOut(const PlaneField& flux, const PlaneMedium& m) {
  double out = 0, in = 0;
  for (const double f : flux) out += 4 * M_PI * f;
  for (const double e : m.irradiance) in += e;
  return out / in;
}

}  // namespace

PaperResult subsurface(const PaperSettings& settings) {
  struct Stuff {
    const char* name;
    double albedo, g;
  };
  const Stuff stuffs[] = {{"isotropic", 0.98, 0}, {"forward, g 0.75", 0.98, 0.75}};
  Csv csv({"stuff", "albedo", "g", "optical_thickness", "rel_rms", "noise", "reflectance_monte_carlo",
           "reflectance_diffusion", "transmittance_monte_carlo", "transmittance_diffusion"});
  PaperResult result;
  Chart chart;
  chart.title = "A thin slice of subsurface scattering (Stam 1995, 5.3)";
  chart.subtitle =
      "corrected diffusion against Monte Carlo; layer lit over an eighth of its width, albedo 0.98";
  chart.x.label = "optical thickness of the layer";
  chart.y.label = "relative error (%)";
  chart.x.scale = chart.y.scale = Scale::kLog;
  chart.y.low = 0.1;
  double thin_inside = 0, thin_reflected = 0, thick_inside = 0;
  int colour = 0;
  for (const Stuff& stuff : stuffs) {
    Series inside{std::string("light inside, ") + stuff.name,
                  {},
                  {},
                  {},
                  false,
                  {},
                  Marker::kDisc,
                  Stroke::kSolid,
                  colour};
    Series back{std::string("reflectance, ") + stuff.name,
                {},
                {},
                {},
                false,
                {},
                Marker::kRing,
                Stroke::kDashed,
                colour};
    ++colour;
    for (const double tau : {0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0}) {
      const PlaneMedium m = layer(tau, stuff.albedo, stuff.g);
      const PlaneSystem system = formPlaneSystem(m, PlaneForm::kCorrected);
      PlaneField I0;
      VCycleSettings v;
      v.relaxations = settings.relaxations;
      v.progress = under("layer", settings.progress);
      solveByVCycles(system, I0, v);
      PlaneTracerSettings tracer;
      tracer.paths = static_cast<uint64_t>(settings.effort * (1 << 19));
      tracer.block = kBlock;
      tracer.progress = v.progress;
      const PlaneTracerResult truth = tracePlane(m, tracer);
      const PlaneField even(truth.I0.size(), 1.0);
      const double error = relativeRms(blockMeans(m.grid, I0, kBlock), truth.I0, even, truth.I0_se);
      const PlaneExit exit = exitOf(m, system, I0);
      const double R = shareOut(exit.reflected, m), T = shareOut(exit.transmitted, m);
      csv.row({stuff.name, number(stuff.albedo), number(stuff.g), number(tau), number(error),
               number(truth.noise(even)), number(truth.reflectance), number(R), number(truth.transmittance),
               number(T)});
      const double off = std::abs(R / truth.reflectance - 1);
      inside.x.push_back(tau);
      inside.y.push_back(100 * std::max(error, 1e-3));
      back.x.push_back(tau);
      back.y.push_back(100 * std::max(off, 1e-3));
      if (tau <= 1) {
        thin_inside = std::max(thin_inside, error);
        thin_reflected = std::max(thin_reflected, off);
      }
      if (tau == 16 && stuff.g == 0) thick_inside = error;
    }
    chart.series.push_back(inside);
    chart.series.push_back(back);
  }
  chart.bands = {{"within 10 %", 0.1, 10}};
  result.add("subsurface", chart);
  result.files.emplace_back("subsurface.csv", csv.text());
  result.claims = {
      {"subsurface", "5.3", "thin layers might not be accurate: the light inside (up to 1 optical depth)",
       "relative RMS from Monte Carlo, the worst", Criterion::kAtLeast, 0.1, thin_inside, 1},
      {"subsurface", "5.3", "thin layers might not be accurate: what they reflect",
       "relative error, the worst", Criterion::kAtLeast, 0.1, thin_reflected, 1},
      {"subsurface", "5.3", "a thick layer (16 optical depths, isotropic) is accurate",
       "relative RMS from Monte Carlo", Criterion::kAtMost, 0.1, thick_inside, 2}};
  return result;
}

}  // namespace vdb_diffuse
