#include <cmath>

#include "paper/part.h"
#include "reference/path_tracer.h"
#include "report/measurement.h"
#include "shapes/solids.h"

namespace vdb_diffuse {
namespace {

constexpr double kDepths[] = {0.5, 1, 2, 4, 8, 16, 32};  // optical, of the cube's side
constexpr double kAlbedos[] = {1, 0.99, 0.95, 0.8, 0.5};
constexpr double kGs[] = {0, 0.5, 0.85};
constexpr int kCells = 16;     // to a side: what errors are means over
constexpr double kGood = 0.1;  // "within 10 %"
constexpr double kRule = 4;    // optical depths: the mean free path is a fourth of the size

/// One cube in sunlight by everything.
struct CubeErrors {
  double printed = 0, p1 = 0, standard = 0;  ///< from Monte Carlo, relative RMS over the voxels
  double p1_from_ordinates = 0;              ///< plain P1 from discrete ordinates
  double ordinates = 0, noise = 0;  ///< discrete ordinates from Monte Carlo, and what that has of noise
};

CubeErrors measured(double depth, double albedo, double g, const PaperSettings& settings) {
  const int block = depth > kCells ? 2 : 1;  // voxels of at most one optical depth
  const size_t side = static_cast<size_t>(kCells * block);
  Medium medium;
  medium.density = makeBox({side * side * side, 1.0 / static_cast<double>(side)});
  medium.optics.sigma_s = Vec3d(albedo * depth);
  medium.optics.sigma_a = Vec3d((1 - albedo) * depth);
  medium.optics.g = g;
  Scene scene;
  scene.lights.push_back({"sun", SunLight{Vec3d(0, 0, -1), Vec3d(1), 0}});
  ReferenceSettings run;
  run.noise = 0.02 / std::sqrt(settings.effort);
  run.samples = static_cast<uint64_t>(settings.effort * 400000);
  run.progress = settings.progress;
  ReferenceResult reference_light = reference(medium, scene, run);
  const GridValues truth = gridValues(medium, std::move(reference_light.diffuse)),
                   se = gridValues(medium, std::move(reference_light.diffuse_se)),
                   density = gridValues(medium, {medium.density.values});
  const auto light = [&](Model model, int sweeps) {
    Method method{"", "", "", {}, {}, {}};
    method.settings.model.model = model;
    method.transport.sweeps = sweeps;
    return gridValues(medium, lightBy(method, medium, scene, 1e-4, settings.progress).diffuse);
  };
  const auto off = [&](const GridValues& values) {
    return compareGrids(values, truth, &se, &density, block).rel_rms;
  };
  CubeErrors cube;
  const GridValues p1 = light(Model::kP1, 0), ordinates = light(Model::kDefault, 6);
  cube.printed = off(light(Model::kPaper, 0));
  cube.p1 = off(p1);
  cube.standard = off(light(Model::kDefault, 0));
  cube.p1_from_ordinates = compareGrids(p1, ordinates, nullptr, &density, block).rel_rms;
  cube.ordinates = off(ordinates);
  cube.noise = compareGrids(truth, truth, &se, &density, block).noise;
  return cube;
}

/// A square for every depth and albedo, with its error in percent.
Panel panelOf(const std::string& title) {
  Panel panel{title, static_cast<int>(std::size(kDepths)), static_cast<int>(std::size(kAlbedos))};
  for (const double depth : kDepths) panel.columns.push_back(number(depth));
  for (const double albedo : kAlbedos) panel.rows.push_back(number(albedo));
  for (size_t n = 0; n < std::size(kDepths); ++n)
    if (kDepths[n] == kRule) panel.marks.push_back(static_cast<double>(n) + 1);
  return panel;
}

void put(Panel& panel, double error) {
  panel.values.push_back(error);
  panel.words.push_back(number(100 * error, error < 0.0995 ? "%.1f" : "%.0f"));
}

/// How many of the points on one side of the rule are within 10 %.
struct Count {
  int good = 0, all = 0;
  void add(double error) {
    good += error <= kGood;
    ++all;
  }
  double share() const { return all > 0 ? static_cast<double>(good) / all : 0; }
};

}  // namespace

PaperResult accuracyMap(const PaperSettings& settings) {
  PanelSheet sheet;
  sheet.title = "Where the diffusion approximation is within 10 %";
  sheet.subtitle =
      "cube in sunlight; percent from Monte Carlo (relative RMS). Right of the dashed line the paper's rule "
      "holds: mean free path below 1/4 of the size";
  sheet.row_names = {"as printed", "plain P1", "default"};
  sheet.rows.resize(3);
  sheet.map = kDifferenceMap;
  sheet.low = 0;
  sheet.high = 2 * kGood;
  sheet.low_label = "0";
  sheet.scale_label = "10 %";
  sheet.high_label = "20 % and more";
  sheet.x_label = "optical depth of the side";
  sheet.y_label = "albedo";
  sheet.cell_width = 52;
  sheet.cell_height = 30;
  Csv csv({"g", "optical_depth", "albedo", "mean_free_path_over_size", "rule_holds", "printed", "p1",
           "default", "p1_from_ordinates", "ordinates", "noise"});
  Count printed_valid, p1_valid, p1_else, default_valid, default_else, transport_valid;
  double worst_ordinates = 0;
  int done = 0;
  for (const double g : kGs) {
    Panel panels[3];
    for (Panel& panel : panels) panel = panelOf("g = " + number(g));
    for (const double albedo : kAlbedos)
      for (const double depth : kDepths) {
        PaperSettings own = settings;
        own.progress = under("cube " + std::to_string(++done), settings.progress);
        const CubeErrors cube = measured(depth, albedo, g, own);
        const bool valid = depth > kRule;
        csv.row({number(g), number(depth), number(albedo), number(1 / depth), valid ? "1" : "0",
                 number(cube.printed), number(cube.p1), number(cube.standard), number(cube.p1_from_ordinates),
                 number(cube.ordinates), number(cube.noise)});
        put(panels[0], cube.printed);
        put(panels[1], cube.p1);
        put(panels[2], cube.standard);
        if (valid) printed_valid.add(cube.printed);
        (valid ? p1_valid : p1_else).add(cube.p1);
        (valid ? default_valid : default_else).add(cube.standard);
        if (depth * (1 - albedo * g) > kRule) transport_valid.add(cube.p1);
        worst_ordinates = std::max(worst_ordinates, cube.ordinates);
      }
    for (int n = 0; n < 3; ++n) sheet.rows[n].push_back(panels[n]);
  }
  PaperResult result;
  result.add("map", sheet);
  result.files.emplace_back("map.csv", csv.text());
  const auto claim = [](const std::string& words, const Count& count) {
    return Claim{"map",
                 "3",
                 words,
                 "of " + std::to_string(count.all) + " cubes are within 10 %",
                 Criterion::kAtLeast,
                 0.9,
                 count.share(),
                 1.25};
  };
  result.claims = {
      claim("within 10 % where the mean free path is below 1/4: as printed", printed_valid),
      claim("within 10 % where the mean free path is below 1/4: plain P1", p1_valid),
      claim("within 10 % where the transport mean free path is: plain P1", transport_valid),
      claim("within 10 % where the mean free path is below 1/4: default model", default_valid),
      claim("within 10 % where it is not, as well: plain P1", p1_else),
      claim("within 10 % where it is not, as well: default model", default_else),
      {"map", "6", "discrete ordinates agree with Monte Carlo",
       "relative RMS of 6 sweeps, the worst of 105 cubes", Criterion::kAtMost, 0.05, worst_ordinates, 2}};
  return result;
}

}  // namespace vdb_diffuse
