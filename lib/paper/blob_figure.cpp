#include <algorithm>
#include <cmath>

#include "paper/part.h"
#include "plane/plane_blobs.h"
#include "plane/plane_tracer.h"
#include "plane/v_cycle.h"

namespace vdb_diffuse {
namespace {

constexpr int kCells = 512, kSummed = 64;  // to a side: of the grid, and of the blobs' integrals
constexpr int kBlock = 4;
constexpr double kOpticalDepth = 20;  // of the densest column
constexpr double kAlbedo = 0.99;
constexpr double kWider = 1.5;  // of the corrected blobs: of 0.8 to 3, it left the smallest error
constexpr double kCap = 0.5;    // L over the root of the cloud's area, as the default model has it in space

struct Way {
  std::string name;
  PlaneField I0;  ///< on the grid
  double seconds = 0, condition = 0;
  size_t unknowns = 0, bytes = 0;
  double error = 0, from_grid = 0;
};

PlaneMedium mediumOf(const std::vector<PlaneBlob>& blobs, int cells, double scale) {
  PlaneMedium m;
  m.grid = {cells, cells, 1.0 / cells};
  m.rho = densityOf(blobs, m.grid);
  m.sigma_s = kAlbedo * scale;
  m.sigma_a = (1 - kAlbedo) * scale;
  m.irradiance.assign(cells, 1);
  return m;
}

double densestColumn(const std::vector<PlaneBlob>& blobs) {
  const PlaneGrid grid{kCells, kCells, 1.0 / kCells};
  const PlaneField rho = densityOf(blobs, grid);
  double most = 0;
  for (int i = 0; i < grid.nx; ++i) {
    double sum = 0;
    for (int j = 0; j < grid.ny; ++j) sum += rho[grid.at(i, j)] * grid.h;
    most = std::max(most, sum);
  }
  return most;
}

/// A cloud of blobs, lit from above, by every way.
struct Cloud {
  std::vector<PlaneBlob> blobs;
  PlaneMedium medium;
  double cap = 0;
  PlaneTracerResult truth;
  double tracer_seconds = 0;
  PlaneField source_centres;  ///< Q0 as the blobs see it, at their centres alone
  std::vector<Way> ways;
};

Way byBlobs(const std::string& name, const Cloud& cloud, double scale, PlaneForm equation,
            PlaneBlobForm form) {
  Way way{name, {}, 0, 0, 0, 0, 0, 0};
  const std::vector<PlaneBlob> basis =
      form == PlaneBlobForm::kGalerkin ? widened(cloud.blobs, kWider) : cloud.blobs;
  PlaneBlobSolution solution;
  way.seconds = secondsOf([&] {
    const PlaneMedium coarse = mediumOf(cloud.blobs, kSummed, scale);
    solution = solvePlaneBlobs(basis, coarse, formPlaneSystem(coarse, equation, cloud.cap), form);
  });
  way.I0 = evaluateBlobs(planeBasis(basis, cloud.medium), solution.I);
  way.condition = solution.condition;
  way.unknowns = cloud.blobs.size();
  way.bytes = way.unknowns * (sizeof(PlaneBlob) + sizeof(double));
  return way;
}

Way byGrid(const std::string& name, const Cloud& cloud, PlaneForm equation, const VCycleSettings& v) {
  Way way{name, {}, 0, 0, 0, 0, 0, 0};
  way.seconds =
      secondsOf([&] { solveByVCycles(formPlaneSystem(cloud.medium, equation, cloud.cap), way.I0, v); });
  way.unknowns = cloud.medium.grid.count();
  way.bytes = way.unknowns * sizeof(double);
  return way;
}

Cloud lightOfBlobs(int count, const PaperSettings& settings) {
  Cloud cloud;
  cloud.blobs = scatterBlobs(count, 1, 7);
  const double scale = kOpticalDepth / densestColumn(cloud.blobs);
  cloud.medium = mediumOf(cloud.blobs, kCells, scale);
  double area = 0;
  for (const double rho : cloud.medium.rho) area += rho > 0 ? 1.0 / (kCells * kCells) : 0;
  cloud.cap = kCap * std::sqrt(area);
  VCycleSettings v;
  v.relaxations = settings.relaxations;
  v.depth = settings.depth;
  v.tolerance = 1e-4;
  v.progress = settings.progress;
  cloud.ways.push_back(
      byBlobs("blobs, as printed", cloud, scale, PlaneForm::kPrinted, PlaneBlobForm::kCollocation));
  cloud.ways.push_back(
      byBlobs("blobs, corrected", cloud, scale, PlaneForm::kCorrected, PlaneBlobForm::kGalerkin));
  cloud.ways.push_back(byGrid("grid, as printed", cloud, PlaneForm::kPrinted, v));
  cloud.ways.push_back(byGrid("grid, corrected", cloud, PlaneForm::kCorrected, v));
  v.relaxations = 3;  // section 5.1
  v.depth = 5;
  cloud.ways.push_back(byGrid("grid, v-cycles of 5.1", cloud, PlaneForm::kCorrected, v));
  PlaneTracerSettings tracer;
  tracer.paths = static_cast<uint64_t>(settings.effort * (1 << 21));
  tracer.block = kBlock;
  tracer.progress = settings.progress;
  const double start = secondsNow();
  cloud.truth = tracePlane(cloud.medium, tracer);
  cloud.tracer_seconds = secondsNow() - start;
  const PlaneField rho = blockMeans(cloud.medium.grid, cloud.medium.rho, kBlock);
  const PlaneField grid = blockMeans(cloud.medium.grid, cloud.ways[3].I0, kBlock);
  for (Way& way : cloud.ways) {
    const PlaneField I0 = blockMeans(cloud.medium.grid, way.I0, kBlock);
    way.error = relativeRms(I0, cloud.truth.I0, rho, cloud.truth.I0_se);
    way.from_grid = relativeRms(I0, grid, rho);
  }
  const PlaneField Q0 = directLight(cloud.medium);
  std::vector<double> at_centres;
  for (const PlaneBlob& b : cloud.blobs)
    at_centres.push_back(
        Q0[cloud.medium.grid.at(static_cast<int>(b.x * kCells), static_cast<int>(b.y * kCells))]);
  cloud.source_centres = evaluateBlobs(planeBasis(cloud.blobs, cloud.medium), at_centres);
  return cloud;
}

constexpr int kShown = 2;  // cells to a pixel

/// In steps too small to see, of which a smaller file is made.
double stepped(double v) {
  constexpr double kSteps = 56;
  return std::round(kSteps * v) / kSteps;
}

/// 5.2: I = tau I_back + (1 - tau) I_ij, tau = exp(-sigma_t rho l), before blue; l such that the cloud is
/// opaque where it is dense.
Panel composited(const std::string& title, const Cloud& cloud, const PlaneField& light, double one) {
  const Colour back{0.10, 0.25, 0.65};
  const PlaneGrid& grid = cloud.medium.grid;
  const PlaneField rho = blockMeans(grid, cloud.medium.rho, kShown), I = blockMeans(grid, light, kShown);
  const double l = 0.15;
  Panel panel{title, grid.nx / kShown, grid.ny / kShown};
  for (size_t c = 0; c < I.size(); ++c) {
    const double tau = stepped(std::exp(-cloud.medium.sigma_t() * rho[c] * l));
    const double v = stepped(std::pow(std::clamp(I[c] / one, 0.0, 1.0), 1 / 2.2));
    const auto mix = [&](double b) { return tau * b + (1 - tau) * v; };
    panel.colours.push_back({mix(back.red), mix(back.green), mix(back.blue)});
  }
  return panel;
}

PanelSheet sheetOf(const Cloud& cloud, const std::string& figure) {
  PanelSheet sheet;
  sheet.title = "A density of " + std::to_string(cloud.blobs.size()) + " blobs lit from above (Stam 1995, " +
                figure + ")";
  sheet.subtitle = "off: relative RMS from Monte Carlo, weighted by density; " + number(kOpticalDepth) +
                   " optical depths in the densest column, albedo " + number(kAlbedo);
  sheet.row_names = {"source", "diffused"};
  sheet.rows.resize(2);
  const PlaneField truth = repeated(cloud.truth.grid, cloud.truth.I0, kBlock);
  const double brightest = *std::max_element(truth.begin(), truth.end());
  const PlaneField Q0 = directLight(cloud.medium);
  const double lit = *std::max_element(Q0.begin(), Q0.end());
  const Way *printed = &cloud.ways[0], *blobs = &cloud.ways[1], *grid = &cloud.ways[3];
  sheet.rows[0] = {composited("at the blobs' centres", cloud, cloud.source_centres, lit),
                   composited("in every cell", cloud, Q0, lit)};
  sheet.rows[1] = {
      composited("blobs as printed: off " + percent(printed->error), cloud, printed->I0, brightest),
      composited("blobs corrected: off " + percent(blobs->error), cloud, blobs->I0, brightest),
      composited("grid: off " + percent(grid->error), cloud, grid->I0, brightest),
      composited("Monte Carlo", cloud, truth, brightest)};
  sheet.scale_label = "";
  return sheet;
}

}  // namespace

PaperResult blobFigure(const PaperSettings& settings) {
  Csv csv({"blobs", "way", "unknowns", "bytes", "seconds", "rel_rms", "rel_rms_from_grid", "noise",
           "condition_number"});
  PaperResult result;
  Chart chart;
  chart.title = "Blobs, the grid and Monte Carlo: time against error";
  chart.subtitle =
      "light in densities of 20 and of 76 blobs; relative RMS from Monte Carlo, weighted by density, and its "
      "own noise";
  chart.x.label = "time (s)";
  chart.y.label = "error (%)";
  chart.x.scale = chart.y.scale = Scale::kLog;
  Cloud last;
  for (const int count : {20, 76}) {
    PaperSettings own = settings;
    own.progress = under(std::to_string(count) + " blobs", settings.progress);
    Cloud cloud = lightOfBlobs(count, own);
    const PlaneField rho = blockMeans(cloud.medium.grid, cloud.medium.rho, kBlock);
    const double noise = cloud.truth.noise(rho);
    Series s{"", {}, {}, {}, false, {}, Marker::kDisc, Stroke::kNone};
    for (const Way& way : cloud.ways) {
      csv.row({std::to_string(count), way.name, std::to_string(way.unknowns), std::to_string(way.bytes),
               number(way.seconds), number(way.error), number(way.from_grid), number(noise),
               way.condition > 0 ? number(way.condition) : ""});
      s.x.push_back(way.seconds);
      s.y.push_back(100 * std::max(way.error, 1e-4));
      s.labels.push_back(std::to_string(count) + ": " + way.name);
    }
    csv.row({std::to_string(count), "Monte Carlo", std::to_string(cloud.truth.I0.size()),
             std::to_string(cloud.truth.I0.size() * sizeof(double)), number(cloud.tracer_seconds), "", "",
             number(noise), ""});
    s.x.push_back(cloud.tracer_seconds);
    s.y.push_back(100 * noise);
    s.labels.push_back(std::to_string(count) + ": Monte Carlo");
    chart.series.push_back(s);
    result.add(count == 20 ? "fig4" : "fig5", sheetOf(cloud, count == 20 ? "Fig. 4" : "Fig. 5"));
    last = std::move(cloud);
  }
  result.add("fig5_methods", chart);
  result.files.emplace_back("fig5.csv", csv.text());
  const Way &printed = last.ways[0], &blobs = last.ways[1], &grid = last.ways[3];
  // Along the cloud's edge, where the density is less than a hundredth of its largest.
  const PlaneField &rho = last.medium.rho, light = repeated(last.truth.grid, last.truth.I0, kBlock);
  const double faint = 0.01 * *std::max_element(rho.begin(), rho.end()),
               brightest = *std::max_element(light.begin(), light.end());
  double edge = 0, cells = 0;
  for (size_t c = 0; c < rho.size(); ++c)
    if (rho[c] > 0 && rho[c] < faint) {
      edge += light[c] / brightest;
      ++cells;
    }
  edge /= cells;
  result.claims = {
      {"fig5", "5.2", "blobs come fairly near to the grid (76 blobs, corrected)",
       "relative RMS from the grid", Criterion::kAtMost, 0.2, blobs.from_grid, 2},
      {"fig5", "5.2", "blobs as printed come fairly near to the grid (76 blobs)",
       "relative RMS from the grid", Criterion::kAtMost, 0.2,
       relativeRms(printed.I0, last.ways[2].I0, last.medium.rho), 2},
      {"fig5", "5.2", "blobs give the light (76 blobs, corrected)", "relative RMS from Monte Carlo",
       Criterion::kAtMost, 0.2, blobs.error, 2},
      {"fig5", "5.2", "blobs take an order of magnitude less time", "x less time than the v-cycles of 5.1",
       Criterion::kAtLeast, 10, last.ways[4].seconds / blobs.seconds, 2},
      {"fig5", "5.2", "and than v-cycles to the coarsest grid", "x less time", Criterion::kAtLeast, 10,
       grid.seconds / blobs.seconds, 2},
      {"fig5", "5.2", "blobs take 0.2 s", "s", Criterion::kAtMost, 0.2, blobs.seconds, 2},
      {"fig5", "5.2", "blobs take an order of magnitude less storage", "x fewer numbers than the grid",
       Criterion::kAtLeast, 10, static_cast<double>(grid.unknowns) / static_cast<double>(blobs.unknowns), 1},
      {"fig5", "5.2", "diffuse light drops to zero at the edge of the density",
       "of the brightest, where the density is below 1 %, by Monte Carlo", Criterion::kAtMost, 0.1, edge, 2},
      {"fig5", "4.2", "LU solves the system stably", "condition number (76 blobs)", Criterion::kAtMost, 1e7,
       blobs.condition, 1}};
  return result;
}

}  // namespace vdb_diffuse
