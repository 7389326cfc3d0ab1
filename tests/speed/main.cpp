#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "hypre_solver.h"
#include "table.h"

// Prints what a bake's steps and its solver cost, in ns per active voxel and in passes over memory, beside
// hypre and OpenVDB's own solver on the same equations in the same run. Times depend on the machine and on
// what else it does; ratios less so.

using namespace vdb_diffuse;
using namespace vdb_diffuse::speed;

namespace {

/// \return what one thread has
Bandwidth printMemory() {
  Bandwidth one_thread;
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    one_thread = measureBandwidth();
    printBandwidth("one thread", one_thread);
  }
  printBandwidth("all threads", measureBandwidth());
  std::fflush(stdout);
  return one_thread;
}

/// 1, 2, 4 .. and as many as there are.
std::vector<int> threadCounts() {
  const int all = tbb::this_task_arena::max_concurrency();
  std::vector<int> counts;
  for (int n = 1; n < all; n *= 2) counts.push_back(n);
  counts.push_back(all);
  return counts;
}

void printIterations(bool raw) {
  std::printf("\niterations to 1e-6%s\n", raw ? ", no cap" : "");
  for (const size_t voxels : {50000, 500000, 5000000}) {
    const CloudSystem system = makeCloudSystem(voxels, raw);
    std::printf("%9zu voxels: %d\n", system.voxels(), countIterations(system, 1e-6));
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<double> sizes{300000, 2000000};
  bool raw = false, iterations = false, no_hypre = false, no_pcg = false, no_phases = false,
       no_solvers = false;
  std::string csv, phases_csv, plot;
  ComparisonSettings settings;
  CLI::App app(
      "Times the steps of a bake, and the diffusion solver beside hypre's BoomerAMG-CG, OpenVDB's pcg and "
      "the "
      "memory's bandwidth");
  app.add_option("--voxels", sizes, "active voxels of the clouds")
      ->delimiter(',')
      ->check(CLI::Range(1.0, 3e8));
  app.add_option("--tolerances", settings.tolerances, "on the diagonally scaled residual")
      ->delimiter(',')
      ->check(CLI::Range(1e-8, 0.1));
  app.add_option("--repeats", settings.repeats, "runs that a median is of")->check(CLI::Range(1, 1000));
  app.add_flag("--raw", raw, "without the mean-free-path cap");
  app.add_flag("--all-threads", settings.all_threads, "ours once more on all threads");
  app.add_flag("--no-hypre", no_hypre, "do not time hypre");
  app.add_flag("--no-pcg", no_pcg, "do not time OpenVDB's conjugate gradients");
  app.add_flag("--no-phases", no_phases, "do not time the steps of a bake");
  app.add_flag("--no-solvers", no_solvers, "time nothing but the steps of a bake");
  app.add_flag("--iterations", iterations, "only count our iterations at 50 k, 500 k and 5 M voxels");
  app.add_option("--csv", csv, "write the solvers' table here too");
  app.add_option("--phases-csv", phases_csv, "write the table of steps here too");
  app.add_option("--plot", plot, "draw the steps against size, an .svg or .png file");
  CLI11_PARSE(app, argc, argv);
  settings.hypre = !no_hypre;
  settings.pcg = !no_pcg;
  PhaseSettings phase_settings;
  phase_settings.repeats = settings.repeats;
  phase_settings.threads = threadCounts();
  phase_settings.tolerances = settings.tolerances;

  try {
    if (iterations) {
      printIterations(raw);
      return 0;
    }
    if (!csv.empty()) writeCsv(csv, {}, 0);  // fail now, not after an hour
    const HypreSession session;
    const Bandwidth memory = printMemory();
    const double R = memory.R;
    std::vector<Phases> phases;
    for (const double voxels : sizes) {
      if (no_phases) break;
      phases.push_back(timePhases(static_cast<size_t>(voxels), phase_settings));
      printPhases(phases.back(), R, memory.triad);
    }
    if (!phases_csv.empty()) writePhases(phases_csv, phases, R);
    if (!plot.empty() && !phases.empty()) drawPhases(plot, phases);
    std::vector<Comparison> comparisons;
    for (const double voxels : sizes) {
      if (no_solvers) break;
      comparisons.push_back(compareSolvers(makeCloudSystem(static_cast<size_t>(voxels), raw), settings));
      printComparison(comparisons.back(), R);
    }
    if (!csv.empty()) writeCsv(csv, comparisons, R);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vdb_diffuse_speed: %s\n", e.what());
    return 1;
  }
  return 0;
}
