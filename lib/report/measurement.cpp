#include "report/measurement.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "reference/path_tracer.h"

namespace vdb_diffuse {
namespace {

constexpr char kMonteCarlo[] = "monte-carlo";

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// The work's own phases, behind the name of what is measured.
Progress under(const std::string& name, const Progress& progress) {
  if (!progress) return {};
  return [name, progress](std::string_view phase, double fraction) {
    progress(name + ": " + std::string(phase), fraction);
  };
}

Errors errorsOf(const GridValues& grid, const Truth& truth, const GridValues& reference, bool noisy,
                int block) {
  const auto norms = [&](int width) {
    return compareGrids(grid, reference, noisy ? &truth.standard_error : nullptr, &truth.density, width);
  };
  Errors errors;
  errors.voxels = norms(1);
  errors.blocks4 = norms(4);
  errors.blocks = block == 1 ? errors.voxels : block == 4 ? errors.blocks4 : norms(block);
  return errors;
}

/// Does the work until it has been done often enough; the median of its times.
template <typename Work>
double medianSeconds(int repeats, Measurement& row, const Work& work) {
  std::vector<double> seconds;
  do {
    const double start = now();
    work();
    seconds.push_back(now() - start);
  } while (static_cast<int>(seconds.size()) < repeats && seconds.front() < kLong);
  row.repeats = static_cast<int>(seconds.size());
  std::sort(seconds.begin(), seconds.end());
  const size_t n = seconds.size();
  return 0.5 * (seconds[(n - 1) / 2] + seconds[n / 2]);
}

}  // namespace

Norms Truth::norms(int block) const {
  return compareGrids(diffuse, diffuse, noisy ? &standard_error : nullptr, &density, block);
}

GridValues gridValues(const Medium& medium, Channels channels) {
  GridValues values;
  values.topology = medium.density.topology;
  values.transform = medium.transform();
  values.channels = std::move(channels);
  return values;
}

Measurement measure(const Method& method, const Medium& medium, const Scene& scene, const Truth& truth,
                    const MeasureSettings& settings) {
  Measurement row;
  row.method = method.name;
  row.label = method.label;
  row.series = method.series;
  DiffuseResult result;
  const Progress progress = under(method.name, settings.progress);
  row.seconds = medianSeconds(settings.repeats, row, [&] {
    result = DiffuseResult();  // so that no run pays for another's memory
    result = lightBy(method, medium, scene, settings.tolerance, progress);
  });
  if (result.mean_free_path_cap > 0) {
    char text[40];
    std::snprintf(text, sizeof text, "cap %.4g", result.mean_free_path_cap);
    row.setting = text;
  }
  row.iterations = result.iterations;
  row.converged = result.converged;
  row.closure = result.energy.closure();
  row.negative_voxels = result.negative_voxels;
  row.estimated_error = result.estimated_error;
  row.warnings = std::move(result.warnings);
  row.errors = errorsOf(gridValues(medium, std::move(result.diffuse)), truth, truth.diffuse, truth.noisy,
                        settings.block);
  return row;
}

double directExcess(const Medium& medium, const Scene& scene, const GridValues& direct,
                    const GridValues& density, const Progress& progress) {
  FirstScatterSettings settings;
  settings.progress = under("direct", progress);
  FirstScatter light = firstScatter(medium, scene, Occluder(scene.surfaces), Model::kDefault, settings);
  return compareGrids(gridValues(medium, std::move(light.direct)), direct, nullptr, &density, 1).bias;
}

std::vector<Measurement> measureFirstScatter(const Medium& medium, const Scene& scene, const Truth& truth,
                                             const MeasureSettings& settings) {
  const Occluder occluder(scene.surfaces);
  std::vector<Measurement> rows(2);
  std::vector<GridValues> direct;
  for (const bool march : {false, true}) {
    Measurement& row = rows[march];
    row.quantity = "direct";
    row.method = march ? "march" : "beams";
    FirstScatterSettings first;
    first.exact_march = march;
    first.progress = under(row.method, settings.progress);
    FirstScatter light;
    row.seconds = medianSeconds(settings.repeats, row, [&] {
      light = FirstScatter();
      light = firstScatter(medium, scene, occluder, Model::kDefault, first);
    });
    direct.push_back(gridValues(medium, std::move(light.direct)));
  }
  for (const bool march : {false, true})
    rows[march].errors = errorsOf(direct[march], truth, direct[!march], false, settings.block);
  return rows;
}

std::vector<Measurement> measureMonteCarlo(const Medium& medium, const Scene& scene, const Truth& truth,
                                           const MeasureSettings& settings,
                                           const MonteCarloSettings& monte_carlo) {
  constexpr int kMostRuns = 16;
  constexpr double kFalls = 0.8;  // an error that is all noise falls to a half
  constexpr uint64_t kGrowth = 4, kVoxelsPerPath = 256, kFewest = 1024;
  ReferenceSettings run;
  run.seed = monte_carlo.seed;
  run.max_bytes = monte_carlo.max_bytes;
  run.samples = kFewest;
  while (run.samples * kVoxelsPerPath < medium.topology().activeVoxelCount()) run.samples *= kGrowth;
  const double noise = truth.norms(settings.block).noise;
  std::vector<Measurement> rows;
  for (int n = 0; n < kMostRuns; ++n) {
    if (run.seed == truth.seed) ++run.seed;
    Measurement row;
    row.method = row.series = kMonteCarlo;
    row.setting = std::to_string(run.samples) + " paths";
    run.progress = under(row.setting, settings.progress);
    const double start = now();
    ReferenceResult result = reference(medium, scene, run);
    row.seconds = now() - start;
    row.samples = result.samples;
    row.closure = result.energy.closure();
    row.warnings = std::move(result.warnings);
    row.errors = errorsOf(gridValues(medium, std::move(result.diffuse)), truth, truth.diffuse, truth.noisy,
                          settings.block);
    rows.push_back(std::move(row));
    // The next one's error is half of this one's, and should still be twice the truth's noise.
    // Where that noise is not known, it shows: more samples no longer help.
    const Measurement& last = rows.back();
    if (n > 0 && last.errors.blocks.rel_rms > kFalls * rows[rows.size() - 2].errors.blocks.rel_rms) break;
    if (last.errors.blocks.rel_rms < 4 * noise || kGrowth * last.seconds > monte_carlo.seconds) break;
    run.samples *= kGrowth;
    ++run.seed;
  }
  return rows;
}

std::vector<CurvePoint> monteCarloCurve(const std::vector<Measurement>& rows) {
  std::vector<CurvePoint> curve;
  for (const Measurement& row : rows)
    if (row.method == kMonteCarlo && row.errors.blocks.rel_rms > 0)
      curve.push_back({row.seconds, row.errors.blocks.rel_rms});
  return curve;
}

void compareWithMonteCarlo(std::vector<Measurement>& rows) {
  const std::vector<CurvePoint> curve = monteCarloCurve(rows);
  for (Measurement& row : rows)
    if (row.quantity == "diffuse" && row.method != kMonteCarlo)
      row.monte_carlo = secondsForError(curve, row.errors.blocks.rel_rms);
}

}  // namespace vdb_diffuse
