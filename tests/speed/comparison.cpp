#include "comparison.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "hypre_solver.h"
#include "multigrid/solve.h"
#include "pcg_solver.h"

namespace vdb_diffuse::speed {
namespace {

struct OurRun {
  Seconds setup, solve;
  int iterations = 0;
  size_t bytes = 0;
  std::vector<double> x;
};

OurRun runOurs(const CloudSystem& system, const Matrix& matrix, double tolerance, int threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  OurRun run;
  const Stopwatch setup_watch;
  Multigrid multigrid(system.equation.A);
  run.setup = setup_watch.read();
  const Stopwatch solve_watch;
  Field<double> x(*system.equation.A->topology);
  SolveSettings settings;
  settings.tolerance = tolerance;
  const SolveReport report = solve(multigrid, system.b, x, settings);
  run.solve = solve_watch.read();
  run.iterations = report.converged ? report.iterations : -1;
  run.bytes = multigrid.bytes();
  run.x = gather(matrix, x);
  return run;
}

double largestDifference(const std::vector<double>& a, const std::vector<double>& b) {
  double difference = 0, largest = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    difference = std::max(difference, std::abs(a[i] - b[i]));
    largest = std::max(largest, std::abs(b[i]));
  }
  return difference / largest;
}

/// All times of one solver at one tolerance, in ns per voxel.
struct Times {
  std::vector<double> setup, solve, total, cpu;
  void add(const Seconds& setup_time, const Seconds& solve_time, double per_voxel) {
    setup.push_back(per_voxel * setup_time.wall);
    solve.push_back(per_voxel * solve_time.wall);
    total.push_back(per_voxel * (setup_time.wall + solve_time.wall));
    cpu.push_back(per_voxel * (setup_time.cpu + solve_time.cpu));
  }
  void report(SolverTime& to) const {
    to.setup = median(setup);
    to.solve = median(solve);
    to.total = median(total);
    to.cpu = median(cpu);
  }
};

/// A peer's times over ours, of neighbouring runs.
struct Ratios {
  std::vector<double> total, cpu;
  void add(const Times& peer, const Times& ours) {
    if (peer.total.empty()) return;
    total.push_back(peer.total.back() / ours.total.back());
    cpu.push_back(peer.cpu.back() / ours.cpu.back());
  }
  void report(const std::string& peer, double tolerance, double difference, Comparison& to) const {
    const auto [low, high] = std::minmax_element(total.begin(), total.end());
    to.ratios.push_back({peer, tolerance, median(total), *low, *high, median(cpu), difference});
  }
};

/// Options for hypre and the iterations they need to a tolerance.
struct Choice {
  HypreOptions options;
  int iterations = -1;
  double seconds = INFINITY;
};

class Comparer {
 public:
  Comparer(const CloudSystem& system, const ComparisonSettings& settings)
      : system_(system),
        settings_(settings),
        per_voxel_(1e9 / static_cast<double>(system.voxels())),
        matrix_(assemble(*system.equation.A)),
        b_(gather(matrix_, system.b)) {}

  Comparison run() {
    result_.voxels = system_.voxels();
    result_.fill = system_.fill();
    result_.cap = system_.equation.settings.cap;
    result_.equation = per_voxel_ * system_.seconds_equation;
    if (settings_.hypre) prepareHypre();
    for (size_t t = 0; t < settings_.tolerances.size(); ++t) compareAt(t);
    return std::move(result_);
  }

 private:
  const CloudSystem& system_;
  const ComparisonSettings& settings_;
  double per_voxel_;
  Matrix matrix_;
  std::vector<double> b_, reference_;
  std::optional<HypreSystem> hypre_;
  std::vector<Choice> choices_;  // by tolerance
  Comparison result_;

  void prepareHypre() {
    hypre_.emplace(matrix_, b_);
    result_.assembly = per_voxel_ * hypre_->secondsAssembly();
    choices_.resize(settings_.tolerances.size());
    for (const auto coarsening : {HypreOptions::kPmis, HypreOptions::kHmis})
      for (const double theta : {0.25, 0.5})
        for (const int aggressive : {0, 1, 2}) tryOptions({coarsening, theta, aggressive});
    constexpr double kReference = 1e-10;
    const HypreOptions& best = choices_.back().options;
    reference_ = hypre_->run(best, hypre_->observe(best, kReference).iterationsTo(kReference)).x;
  }

  void tryOptions(const HypreOptions& options) {
    double tightest = 1;
    for (double tolerance : settings_.tolerances) tightest = std::min(tightest, tolerance);
    const HypreHistory history = hypre_->observe(options, tightest);
    char text[120];
    std::snprintf(text, sizeof text, "%-32s setup %6.0f", options.name().c_str(),
                  per_voxel_ * history.setup.cpu);
    std::string line = text;
    for (size_t t = 0; t < settings_.tolerances.size(); ++t) {
      const int iterations = history.iterationsTo(settings_.tolerances[t]);
      if (iterations < 0) continue;
      const double seconds = history.setup.cpu + history.seconds[iterations];
      std::snprintf(text, sizeof text, "   %.0e: %6.0f in %3d", settings_.tolerances[t], per_voxel_ * seconds,
                    iterations);
      line += text;
      if (seconds < choices_[t].seconds) choices_[t] = {options, iterations, seconds};
    }
    result_.tried.push_back(line);
  }

  void compareAt(size_t t) {
    const double tolerance = settings_.tolerances[t];
    const int all = tbb::this_task_arena::max_concurrency();
    Times ours, hypre, pcg, ours_on_all;
    OurRun our_run;
    HypreRun hypre_run;
    PcgRun pcg_run;
    const double bound = settings_.pcg ? boundFor(matrix_, b_, tolerance) : 0;
    Ratios to_hypre, to_pcg;
    const auto us = [&] {
      our_run = runOurs(system_, matrix_, tolerance, 1);
      ours.add(our_run.setup, our_run.solve, per_voxel_);
    };
    const auto them = [&] {
      if (!hypre_) return;
      hypre_run = hypre_->run(choices_[t].options, choices_[t].iterations);
      hypre.add(hypre_run.setup, hypre_run.solve, per_voxel_);
    };
    const auto openvdb = [&] {
      if (!settings_.pcg) return;
      pcg_run = runPcg(matrix_, b_, bound, 1);
      pcg.add(pcg_run.setup, pcg_run.solve, per_voxel_);
    };
    for (int i = 0; i < settings_.repeats; ++i) {
      if (i % 2) them();
      if (i % 2) openvdb();
      us();
      if (i % 2 == 0) openvdb();
      if (i % 2 == 0) them();
      to_hypre.add(hypre, ours);
      to_pcg.add(pcg, ours);
    }
    note("ours", 1, tolerance, ours, our_run.iterations, our_run.bytes, our_run.x);
    if (settings_.all_threads) {
      OurRun run;
      for (int i = 0; i < settings_.repeats; ++i) {
        run = runOurs(system_, matrix_, tolerance, all);
        ours_on_all.add(run.setup, run.solve, per_voxel_);
      }
      note("ours", all, tolerance, ours_on_all, run.iterations, run.bytes, run.x);
    }
    if (settings_.pcg) {
      note("OpenVDB pcg, scaled, IC", 1, tolerance, pcg, pcg_run.iterations, pcg_run.bytes, pcg_run.x);
      to_pcg.report("OpenVDB pcg", tolerance, largestDifference(our_run.x, pcg_run.x), result_);
    }
    if (!hypre_) return;
    note("hypre " + choices_[t].options.name(), 1, tolerance, hypre, hypre_run.iterations,
         hypre_run.bytes + hypre_->bytes(), hypre_run.x);
    to_hypre.report("hypre", tolerance, largestDifference(our_run.x, hypre_run.x), result_);
  }

  void note(const std::string& solver, int threads, double tolerance, const Times& times, int iterations,
            size_t bytes, const std::vector<double>& x) {
    SolverTime time;
    time.solver = solver;
    time.threads = threads;
    time.tolerance = tolerance;
    time.iterations = iterations;
    times.report(time);
    time.bytes_per_voxel = static_cast<double>(bytes) / static_cast<double>(system_.voxels());
    time.residual = scaledResidual(matrix_, b_, x);
    time.error = reference_.empty() ? NAN : largestDifference(x, reference_);
    result_.times.push_back(time);
  }
};

}  // namespace

Comparison compareSolvers(const CloudSystem& system, const ComparisonSettings& settings) {
  return Comparer(system, settings).run();
}

int countIterations(const CloudSystem& system, double tolerance) {
  Multigrid multigrid(system.equation.A);
  Field<double> x(*system.equation.A->topology);
  SolveSettings settings;
  settings.tolerance = tolerance;
  const SolveReport report = solve(multigrid, system.b, x, settings);
  return report.converged ? report.iterations : -1;
}

}  // namespace vdb_diffuse::speed
