#include "paper/beam.h"

#include <algorithm>
#include <cmath>

#include "paper/part.h"

namespace vdb_diffuse {
namespace {

constexpr double kBeamWidth = 1.0 / 8;  // of the square

double meanOf(const PlaneField& v) {
  double sum = 0;
  for (const double x : v) sum += x;
  return sum / static_cast<double>(v.size());
}

/// The part of the scattered light that is beside the beam's own columns.
double spreadOf(const PlaneField& I0, const PlaneGrid& grid) {
  double beside = 0, all = 0;
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const double x = std::abs((i + 0.5) / grid.nx - 0.5), v = std::max(0.0, I0[grid.at(i, j)]);
      all += v;
      if (x > 0.5 * kBeamWidth) beside += v;
    }
  return all > 0 ? beside / all : 0;
}

/// Logarithm of values over one, from `kDecades` below it; the beam comes in from below.
constexpr double kDecades = 3;
Panel panelOf(const std::string& title, const PlaneGrid& grid, const PlaneField& field, double one) {
  Panel panel{title, grid.nx, grid.ny};
  for (int j = grid.ny - 1; j >= 0; --j)
    for (int i = 0; i < grid.nx; ++i)
      panel.values.push_back(std::log10(std::max(1e-30, field[grid.at(i, j)] / one)));
  return panel;
}

}  // namespace

PlaneMedium beamMedium(const BeamCase& beam, int cells) {
  PlaneMedium m;
  m.grid = {cells, cells, 1.0 / cells};
  m.rho.assign(m.grid.count(), 1.0);
  m.sigma_s = beam.albedo * beam.tau;
  m.sigma_a = (1 - beam.albedo) * beam.tau;
  m.g = beam.g;
  for (int i = 0; i < cells; ++i)
    m.irradiance.push_back(std::abs((i + 0.5) / cells - 0.5) < 0.5 * kBeamWidth ? 1 : 0);
  return m;
}

BeamLight lightOfBeam(const BeamCase& beam, const PaperSettings& settings) {
  BeamLight light;
  light.beam = beam;
  light.medium = beamMedium(beam);
  VCycleSettings v;
  v.relaxations = settings.relaxations;
  v.depth = settings.depth;
  v.tolerance = 1e-5;
  v.progress = settings.progress;
  solveByVCycles(formPlaneSystem(light.medium, PlaneForm::kPrinted), light.printed, v);
  light.report = solveByVCycles(formPlaneSystem(light.medium, PlaneForm::kCorrected), light.corrected, v);
  PlaneTracerSettings tracer;
  tracer.paths = static_cast<uint64_t>(settings.effort * (1 << 19));
  tracer.block = kBeamBlock;
  tracer.progress = settings.progress;
  light.truth = tracePlane(light.medium, tracer);
  const PlaneField even(light.truth.I0.size(), 1.0);
  const auto error = [&](const PlaneField& I0) {
    return relativeRms(blockMeans(light.medium.grid, I0, kBeamBlock), light.truth.I0, even,
                       light.truth.I0_se);
  };
  light.printed_error = error(light.printed);
  light.corrected_error = error(light.corrected);
  return light;
}

PaperResult reducedAndDiffuse(const PaperSettings& settings) {
  const BeamLight light = lightOfBeam({}, settings);
  const PlaneGrid &grid = light.medium.grid, &blocks = light.truth.grid;
  const PlaneField Q0 = blockMeans(grid, directLight(light.medium), kBeamBlock),
                   corrected = blockMeans(grid, light.corrected, kBeamBlock),
                   printed = blockMeans(grid, light.printed, kBeamBlock);
  Csv csv({"cut", "position", "reduced_incident", "diffuse_monte_carlo", "standard_error",
           "diffuse_corrected", "diffuse_printed"});
  PaperResult result;
  const int middle = blocks.nx / 2, shallow = blocks.ny / 10;
  for (const bool along : {true, false}) {
    Series reduced{"reduced incident", {}, {}, {}, false, {}, Marker::kNone, Stroke::kSolid, 4};
    Series truth{"diffuse, Monte Carlo", {}, {}, {}, false, {}, Marker::kDisc, Stroke::kNone, 6};
    Series right{"diffuse, corrected", {}, {}, {}, false, {}, Marker::kNone, Stroke::kSolid, 0};
    Series wrong{"diffuse, as printed", {}, {}, {}, false, {}, Marker::kNone, Stroke::kDashed, 1};
    for (int n = 0; n < (along ? blocks.ny : blocks.nx); ++n) {
      const size_t c = along ? blocks.at(middle, n) : blocks.at(n, shallow);
      const double x = (n + 0.5) * blocks.h;
      csv.row({along ? "along" : "across", number(x), number(Q0[c]), number(light.truth.I0[c]),
               number(light.truth.I0_se[c]), number(corrected[c]), number(printed[c])});
      const auto push = [&](Series& s, double v) {
        if (!along || v > 0) {
          s.x.push_back(x);
          s.y.push_back(v);
        }
      };
      push(reduced, Q0[c]);
      push(right, corrected[c]);
      push(wrong, printed[c]);
      if (n % 2 == 0 && light.truth.I0[c] > 0) {
        push(truth, light.truth.I0[c]);
        truth.y_error.push_back(light.truth.I0_se[c]);
      }
    }
    Chart chart;
    chart.title = along ? "Reduced incident and diffuse intensity along a beam"
                        : "Reduced incident and diffuse intensity across a beam";
    chart.subtitle = "mean over directions; square of " + number(light.beam.tau) +
                     " optical depths, albedo " + number(light.beam.albedo) + ", isotropic" +
                     (along ? ", on the beam's axis" : "; a tenth of the way in");
    chart.x.label = along ? "depth (widths of the square)" : "across (widths of the square)";
    chart.y.label = "intensity (W/m²/sr)";
    if (along) {
      chart.y.scale = Scale::kLog;
      chart.y.low = 1e-5;
    }
    chart.series = {reduced, wrong, right, truth};
    result.add(along ? "fig1_along" : "fig1_across", chart);
  }
  result.files.emplace_back("fig1.csv", csv.text());
  double outside = 0, all = 0;
  for (int i = 0; i < blocks.nx; ++i) {
    const size_t c = blocks.at(i, shallow);
    all += light.truth.I0[c];
    if (Q0[c] == 0) outside += light.truth.I0[c];
  }
  result.claims.push_back({"fig1", "2", "diffuse light goes where no reduced incident light is",
                           "of the diffuse light beside the beam", Criterion::kAtLeast, 0.1, outside / all,
                           1});
  return result;
}

PaperResult beamFigure(const PaperSettings& settings) {
  struct Row {
    const char* name;
    BeamCase cases[3];
    std::string (*words)(const BeamCase&);
  };
  const Row rows[] = {{"albedo",
                       {{0.6, 20, 0}, {0.9, 20, 0}, {0.99, 20, 0}},
                       [](const BeamCase& b) { return "Ω = " + number(b.albedo); }},
                      {"extinction",
                       {{0.99, 5, 0}, {0.99, 20, 0}, {0.99, 80, 0}},
                       [](const BeamCase& b) { return "σt = " + number(b.tau); }},
                      {"mu_bar", {{0.99, 20, -0.5}, {0.99, 20, 0}, {0.99, 20, 0.75}}, [](const BeamCase& b) {
                         return "μ̄ = " + number(3 * b.g);
                       }}};
  PanelSheet sheet;
  sheet.title = "Light beam in a constant density atmosphere (Stam 1995, Fig. 3)";
  sheet.subtitle =
      "512 × 512 cells; unless it is named: albedo 0.99, extinction 20 per side, isotropic. Off: relative "
      "RMS "
      "from Monte Carlo";
  sheet.rows.resize(4);
  sheet.row_names = {"source", "as printed", "corrected", "Monte Carlo"};
  sheet.low = -kDecades;
  sheet.high = 0;
  sheet.low_label = "10⁻³";
  sheet.high_label = "1";
  sheet.scale_label = "over the largest of Monte Carlo (source: over its own), logarithmic";
  constexpr int kShown = 4;  // cells to a pixel
  Csv csv({"varied", "albedo", "sigma_t", "mu_bar", "printed_rel_rms", "corrected_rel_rms", "noise",
           "beside_monte_carlo", "beside_corrected", "beside_printed", "mean_monte_carlo", "mean_corrected",
           "mean_printed", "cycles", "seconds"});
  PaperResult result;
  double worst = 0, least_printed = HUGE_VAL;
  std::vector<double> by_albedo, by_mu_bar;
  int done = 0;
  std::vector<std::pair<std::string, BeamLight>> known;
  for (const Row& row : rows)
    for (const BeamCase& beam : row.cases) {
      const std::string key = number(beam.albedo) + "/" + number(beam.tau) + "/" + number(beam.g);
      auto found = std::find_if(known.begin(), known.end(), [&](const auto& k) { return k.first == key; });
      if (found == known.end()) {
        PaperSettings own = settings;
        own.progress = under("case " + std::to_string(++done), settings.progress);
        known.emplace_back(key, lightOfBeam(beam, own));
        found = known.end() - 1;
      }
      const BeamLight& light = found->second;
      const PlaneGrid& grid = light.medium.grid;
      const PlaneGrid shown{grid.nx / kShown, grid.ny / kShown, grid.h * kShown};
      const double one = *std::max_element(light.truth.I0.begin(), light.truth.I0.end());
      PlaneField source = blockMeans(grid, directLight(light.medium), kShown);
      const double brightest = *std::max_element(source.begin(), source.end());
      sheet.rows[0].push_back(panelOf(row.words(beam), shown, source, brightest));
      sheet.rows[1].push_back(panelOf("off " + percent(light.printed_error), shown,
                                      blockMeans(grid, light.printed, kShown), one));
      sheet.rows[2].push_back(panelOf("off " + percent(light.corrected_error), shown,
                                      blockMeans(grid, light.corrected, kShown), one));
      const double noise = light.truth.noise(PlaneField(light.truth.I0.size(), 1.0));
      sheet.rows[3].push_back(panelOf("noise " + percent(noise), shown,
                                      repeated(light.truth.grid, light.truth.I0, kBeamBlock / kShown), one));
      const double beside = spreadOf(light.truth.I0, light.truth.grid);
      csv.row({row.name, number(beam.albedo), number(beam.tau), number(3 * beam.g),
               number(light.printed_error), number(light.corrected_error), number(noise), number(beside),
               number(spreadOf(light.corrected, grid)), number(spreadOf(light.printed, grid)),
               number(meanOf(light.truth.I0)), number(meanOf(light.corrected)), number(meanOf(light.printed)),
               std::to_string(light.report.residual.size() - 1), number(light.report.seconds.back())});
      if (row.name == std::string("albedo")) by_albedo.push_back(beside);
      if (row.name == std::string("mu_bar")) by_mu_bar.push_back(beside);
      worst = std::max(worst, light.corrected_error);
      least_printed = std::min(least_printed, light.printed_error);
    }
  result.add("fig3", sheet);
  result.files.emplace_back("fig3.csv", csv.text());
  const auto leastStep = [](const std::vector<double>& v) { return std::min(v[1] / v[0], v[2] / v[1]); };
  result.claims = {
      {"fig3", "3", "equations as printed give the light (best of 7 beams)", "relative RMS from Monte Carlo",
       Criterion::kAtMost, 0.1, least_printed, 2},
      {"fig3", "3", "corrected equations give the light (worst of 7 beams)", "relative RMS from Monte Carlo",
       Criterion::kAtMost, 0.1, worst, 3},
      {"fig3", "5.1", "diffusion grows with the albedo",
       "of the spread from one albedo to the next, at least", Criterion::kAtLeast, 1, leastStep(by_albedo),
       1},
      {"fig3", "5.1", "diffusion grows with mu_bar", "of the spread from one mu_bar to the next, at least",
       Criterion::kAtLeast, 1, leastStep(by_mu_bar), 1}};
  return result;
}

}  // namespace vdb_diffuse
