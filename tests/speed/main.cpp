#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "hypre_solver.h"
#include "table.h"

// Prints what the solver costs, in ns per active voxel and in passes over memory, beside hypre on the same
// equations in the same run. Times depend on the machine and on what else it does; ratios less so.

using namespace vdb_diffuse;
using namespace vdb_diffuse::speed;

namespace {

double printMemory() {
  double R = 0;
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const Bandwidth bandwidth = measureBandwidth();
    printBandwidth("one thread", bandwidth);
    R = bandwidth.R;
  }
  printBandwidth("all threads", measureBandwidth());
  std::fflush(stdout);
  return R;
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
  bool raw = false, iterations = false, no_hypre = false;
  std::string csv;
  ComparisonSettings settings;
  CLI::App app("Times the diffusion solver against hypre BoomerAMG-CG and the memory's bandwidth");
  app.add_option("--voxels", sizes, "active voxels of the clouds")
      ->delimiter(',')
      ->check(CLI::Range(1.0, 3e8));
  app.add_option("--tolerances", settings.tolerances, "on the diagonally scaled residual")
      ->delimiter(',')
      ->check(CLI::Range(1e-8, 0.1));
  app.add_option("--repeats", settings.repeats, "runs that a median is of")->check(CLI::Range(1, 1000));
  app.add_flag("--raw", raw, "without the mean-free-path cap");
  app.add_flag("--all-threads", settings.all_threads, "ours once more on all threads");
  app.add_flag("--no-hypre", no_hypre, "ours only");
  app.add_flag("--iterations", iterations, "only count our iterations at 50 k, 500 k and 5 M voxels");
  app.add_option("--csv", csv, "write the table here too");
  CLI11_PARSE(app, argc, argv);
  settings.hypre = !no_hypre;

  try {
    if (iterations) {
      printIterations(raw);
      return 0;
    }
    if (!csv.empty()) writeCsv(csv, {}, 0);  // fail now, not after an hour
    const HypreSession session;
    const double R = printMemory();
    std::vector<Comparison> comparisons;
    for (const double voxels : sizes) {
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
