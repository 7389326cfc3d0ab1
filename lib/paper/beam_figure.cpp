#include <algorithm>
#include <cmath>

#include "paper/beam.h"
#include "paper/part.h"

namespace vdb_diffuse {
namespace {

double meanOf(const PlaneField& v) {
  double sum = 0;
  for (const double x : v) sum += x;
  return sum / static_cast<double>(v.size());
}

double medianOf(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return 0.5 * (v[(v.size() - 1) / 2] + v[v.size() / 2]);
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

/// A row of blocks through the light, along the beam's axis or across it.
struct Cut {
  bool along;
  std::vector<size_t> blocks;
};

Cut cutThrough(const PlaneGrid& blocks, bool along) {
  Cut cut{along, {}};
  const int middle = blocks.nx / 2, shallow = blocks.ny / 10;
  for (int n = 0; n < (along ? blocks.ny : blocks.nx); ++n)
    cut.blocks.push_back(along ? blocks.at(middle, n) : blocks.at(n, shallow));
  return cut;
}

/// What the cuts show, by block.
struct BeamBlocks {
  PlaneField reduced, corrected, printed;

  explicit BeamBlocks(const BeamLight& light) {
    const PlaneGrid& grid = light.medium.grid;
    reduced = blockMeans(grid, directLight(light.medium), kBeamBlock);
    corrected = blockMeans(grid, light.corrected, kBeamBlock);
    printed = blockMeans(grid, light.printed, kBeamBlock);
  }
};

Chart chartOf(const BeamLight& light, const BeamBlocks& blocks, const Cut& cut) {
  Chart chart;
  chart.title =
      std::string("Reduced incident and diffuse intensity ") + (cut.along ? "along" : "across") + " a beam";
  chart.subtitle = "mean over directions; square of " + number(light.beam.tau) + " optical depths, albedo " +
                   number(light.beam.albedo) + ", isotropic" +
                   (cut.along ? ", on the beam's axis" : "; a tenth of the way in");
  chart.x.label = cut.along ? "depth (widths of the square)" : "across (widths of the square)";
  chart.y.label = "intensity (W/m²/sr)";
  if (cut.along) {
    chart.y.scale = Scale::kLog;
    chart.y.low = 1e-5;
  }
  Series reduced{"reduced incident", {}, {}, {}, false, {}, Marker::kNone, Stroke::kSolid, 4};
  Series truth{"diffuse, Monte Carlo", {}, {}, {}, false, {}, Marker::kDisc, Stroke::kNone, 6};
  Series right{"diffuse, corrected", {}, {}, {}, false, {}, Marker::kNone, Stroke::kSolid, 0};
  Series wrong{"diffuse, as printed", {}, {}, {}, false, {}, Marker::kNone, Stroke::kDashed, 1};
  for (size_t n = 0; n < cut.blocks.size(); ++n) {
    const size_t c = cut.blocks[n];
    const auto push = [&](Series& s, double v) {
      if (cut.along && v <= 0) return;
      s.x.push_back((static_cast<double>(n) + 0.5) * light.truth.grid.h);
      s.y.push_back(v);
    };
    push(reduced, blocks.reduced[c]);
    push(right, blocks.corrected[c]);
    push(wrong, blocks.printed[c]);
    if (n % 2 == 1 || light.truth.I0[c] <= 0) continue;
    push(truth, light.truth.I0[c]);
    truth.y_error.push_back(light.truth.I0_se[c]);
  }
  chart.series = {reduced, wrong, right, truth};
  return chart;
}

/// One of the figure's three parameters.
struct Variation {
  std::string name;
  std::vector<BeamCase> cases;
  std::string (*words)(const BeamCase&);
};

std::vector<Variation> variations() {
  return {{"albedo",
           {{0.6, 20, 0}, {0.9, 20, 0}, {0.99, 20, 0}},
           [](const BeamCase& b) { return "Ω = " + number(b.albedo); }},
          {"extinction",
           {{0.99, 5, 0}, {0.99, 20, 0}, {0.99, 80, 0}},
           [](const BeamCase& b) { return "σt = " + number(b.tau); }},
          {"mu_bar", {{0.99, 20, -0.5}, {0.99, 20, 0}, {0.99, 20, 0.75}}, [](const BeamCase& b) {
             return "μ̄ = " + number(3 * b.g);
           }}};
}

PanelSheet beamSheet() {
  PanelSheet sheet;
  sheet.title = "Light beam in a constant density atmosphere (Stam 1995, Fig. 3)";
  sheet.subtitle =
      "512 × 512 cells; unless it is named: albedo 0.99, extinction 20 per side, isotropic. Off: relative "
      "RMS from Monte Carlo";
  sheet.rows.resize(4);
  sheet.row_names = {"source", "as printed", "corrected", "Monte Carlo"};
  sheet.low = -kDecades;
  sheet.high = 0;
  sheet.low_label = "10⁻³";
  sheet.high_label = "1";
  sheet.scale_label = "over the largest of Monte Carlo (source: over its own), logarithmic";
  return sheet;
}

/// A column of the sheet.
void addPanels(PanelSheet& sheet, const BeamLight& light, const std::string& words) {
  constexpr int kShown = 4;  // cells to a pixel
  const PlaneGrid& grid = light.medium.grid;
  const PlaneGrid shown{grid.nx / kShown, grid.ny / kShown, grid.h * kShown};
  const double one = *std::max_element(light.truth.I0.begin(), light.truth.I0.end());
  const PlaneField source = blockMeans(grid, directLight(light.medium), kShown);
  sheet.rows[0].push_back(panelOf(words, shown, source, *std::max_element(source.begin(), source.end())));
  sheet.rows[1].push_back(
      panelOf("off " + percent(light.printed_error), shown, blockMeans(grid, light.printed, kShown), one));
  sheet.rows[2].push_back(panelOf("off " + percent(light.corrected_error), shown,
                                  blockMeans(grid, light.corrected, kShown), one));
  sheet.rows[3].push_back(panelOf("noise " + percent(light.noise()), shown,
                                  repeated(light.truth.grid, light.truth.I0, kBeamBlock / kShown), one));
}

/// Every case once, in the order of the variations.
std::vector<BeamLight> distinctBeams(const PaperSettings& settings) {
  std::vector<BeamLight> lights;
  for (const Variation& variation : variations())
    for (const BeamCase& beam : variation.cases) {
      if (std::any_of(lights.begin(), lights.end(), [&](const BeamLight& l) { return l.beam == beam; }))
        continue;
      PaperSettings own = settings;
      own.progress = under("beam " + std::to_string(lights.size() + 1), settings.progress);
      lights.push_back(lightOfBeam(beam, own));
    }
  return lights;
}

/// By how much the spread of the light grows from one value to the next, at least.
double leastGrowth(const std::vector<double>& spread) {
  double least = HUGE_VAL;
  for (size_t n = 1; n < spread.size(); ++n) least = std::min(least, spread[n] / spread[n - 1]);
  return least;
}

}  // namespace

PaperResult reducedAndDiffuse(const PaperSettings& settings) {
  const BeamLight light = lightOfBeam({}, settings);
  const BeamBlocks blocks(light);
  const PlaneTracerResult& truth = light.truth;
  Csv csv({"cut", "position", "reduced_incident", "diffuse_monte_carlo", "standard_error",
           "diffuse_corrected", "diffuse_printed"});
  PaperResult result;
  double beside = 0, all = 0;
  for (const bool along : {true, false}) {
    const Cut cut = cutThrough(truth.grid, along);
    result.add(along ? "fig1_along" : "fig1_across", chartOf(light, blocks, cut));
    for (size_t n = 0; n < cut.blocks.size(); ++n) {
      const size_t c = cut.blocks[n];
      csv.row({along ? "along" : "across", number((static_cast<double>(n) + 0.5) * truth.grid.h),
               number(blocks.reduced[c]), number(truth.I0[c]), number(truth.I0_se[c]),
               number(blocks.corrected[c]), number(blocks.printed[c])});
      if (along) continue;
      all += truth.I0[c];
      if (blocks.reduced[c] == 0) beside += truth.I0[c];
    }
  }
  result.files.emplace_back("fig1.csv", csv.text());
  result.claims = {{"fig1", "2", "diffuse light goes where no reduced incident light is",
                    "of the diffuse light beside the beam", Criterion::kAtLeast, 0.1, beside / all, 1}};
  return result;
}

PaperResult beamFigure(const PaperSettings& settings) {
  const std::vector<BeamLight> lights = distinctBeams(settings);
  PanelSheet sheet = beamSheet();
  Csv csv({"varied", "albedo", "sigma_t", "mu_bar", "printed_rel_rms", "corrected_rel_rms", "noise",
           "beside_monte_carlo", "beside_corrected", "beside_printed", "mean_monte_carlo", "mean_corrected",
           "mean_printed", "cycles", "seconds"});
  std::vector<double> growth;  // by variation
  for (const Variation& variation : variations()) {
    std::vector<double> spread;
    for (const BeamCase& beam : variation.cases) {
      const BeamLight& light =
          *std::find_if(lights.begin(), lights.end(), [&](const BeamLight& l) { return l.beam == beam; });
      const PlaneGrid& grid = light.medium.grid;
      addPanels(sheet, light, variation.words(beam));
      spread.push_back(spreadOf(light.truth.I0, light.truth.grid));
      csv.row({variation.name, number(beam.albedo), number(beam.tau), number(3 * beam.g),
               number(light.printed_error), number(light.corrected_error), number(light.noise()),
               number(spread.back()), number(spreadOf(light.corrected, grid)),
               number(spreadOf(light.printed, grid)), number(meanOf(light.truth.I0)),
               number(meanOf(light.corrected)), number(meanOf(light.printed)),
               std::to_string(light.report.residual.size() - 1), number(light.report.seconds.back())});
    }
    growth.push_back(leastGrowth(spread));
  }
  std::vector<double> printed, corrected;
  for (const BeamLight& light : lights) {
    printed.push_back(light.printed_error);
    corrected.push_back(light.corrected_error);
  }
  constexpr double kGood = 0.1;
  const std::string median = "relative RMS from Monte Carlo, median of " + std::to_string(lights.size());
  PaperResult result;
  result.add("fig3", sheet);
  result.files.emplace_back("fig3.csv", csv.text());
  result.claims = {
      {"fig3", "3", "equations as printed give the light of a beam", median, Criterion::kAtMost, kGood,
       medianOf(printed), 2},
      {"fig3", "3", "corrected equations give the light of a beam", median, Criterion::kAtMost, kGood,
       medianOf(corrected), 2},
      {"fig3", "3", "and of the worst of the beams", "relative RMS from Monte Carlo", Criterion::kAtMost,
       kGood, *std::max_element(corrected.begin(), corrected.end()), 2},
      {"fig3", "5.1", "diffusion grows with the albedo",
       "of the spread from one albedo to the next, at least", Criterion::kAtLeast, 1, growth[0], 1},
      {"fig3", "5.1", "diffusion grows with mu_bar", "of the spread from one mu_bar to the next, at least",
       Criterion::kAtLeast, 1, growth[2], 1}};
  return result;
}

}  // namespace vdb_diffuse
