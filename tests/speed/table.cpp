#include "table.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>

#include "grid/error.h"
#include "plot/chart.h"

namespace vdb_diffuse::speed {

void printBandwidth(const char* threads, const Bandwidth& bandwidth) {
  std::printf("memory, %-12s copy %6.1f GB/s   triad %6.1f GB/s   R %.3f ns per voxel\n", threads,
              bandwidth.copy, bandwidth.triad, bandwidth.R);
}

void printComparison(const Comparison& c, double R) {
  std::printf("\ncloud of %zu active voxels, %.0f %% of those stored, ", c.voxels, 100 * c.fill);
  if (std::isfinite(c.cap))
    std::printf("mean free path capped at %.3g\n", c.cap);
  else
    std::printf("no cap\n");
  std::printf("in no total: equation %.1f ns per voxel, hypre's copy of the matrix %.1f\n", c.equation,
              c.assembly);
  if (!c.tried.empty())
    std::printf("hypre's options, one run each, processor's ns per voxel with setup, and iterations:\n");
  for (const std::string& line : c.tried) std::printf("  %s\n", line.c_str());
  std::printf("%-38s %7s %5s %5s | %8s %8s %8s | %6s %8s | %6s | %9s %9s\n", "solver", "threads", "to",
              "iter.", "setup", "solve", "total ns", "x R", "cpu ns", "bytes", "residual", "error");
  for (const SolverTime& t : c.times)
    std::printf("%-38s %7d %5.0e %5d | %8.1f %8.1f %8.1f | %6.0f %8.1f | %6.1f | %9.2e %9.2e\n",
                t.solver.c_str(), t.threads, t.tolerance, t.iterations, t.setup, t.solve, t.total,
                t.total / R, t.cpu, t.bytes_per_voxel, t.residual, t.error);
  for (const Comparison::Ratio& r : c.ratios)
    std::printf(
        "%s / ours to %.0e: %.2f (%.2f to %.2f), by processor time %.2f; their solutions differ by %.1e "
        "of the largest\n",
        r.peer.c_str(), r.tolerance, r.median, r.lowest, r.highest, r.cpu, r.difference);
  std::fflush(stdout);
}

void printPhases(const Phases& phases, double R, double triad) {
  std::printf("\nsteps of a bake, cloud of %zu active voxels, %.0f %% of those stored\n", phases.voxels,
              100 * phases.fill);
  std::printf("%-28s %7s | %8s %6s | %8s %9s | %10s\n", "step", "threads", "ns", "x R", "B moved", "of limit",
              "efficiency");
  for (const PhaseTime& t : phases.times) {
    const double limit = t.bytes / triad;  // ns: GB/s are bytes per ns
    const auto one = std::find_if(phases.times.begin(), phases.times.end(),
                                  [&](const PhaseTime& o) { return o.threads == 1 && o.name == t.name; });
    char bytes[40] = "       -         -", efficiency[20] = "-";
    if (t.bytes > 0) std::snprintf(bytes, sizeof bytes, "%8.0f %7.0f %%", t.bytes, 100 * limit / t.ns);
    if (one != phases.times.end() && t.threads > 1)
      std::snprintf(efficiency, sizeof efficiency, "%.2f", one->ns / t.ns / t.threads);
    std::printf("%-28s %7d | %8.1f %6.1f | %s | %10s\n", t.name.c_str(), t.threads, t.ns, t.ns / R, bytes,
                efficiency);
  }
  std::fflush(stdout);
}

void writePhases(const std::string& path, const std::vector<Phases>& sizes, double R) {
  std::ofstream file(path);
  file << "voxels,fill,R_ns,step,threads,ns,ns_over_R,bytes_moved\n";
  for (const Phases& p : sizes)
    for (const PhaseTime& t : p.times)
      file << p.voxels << ',' << p.fill << ',' << R << ",\"" << t.name << "\"," << t.threads << ',' << t.ns
           << ',' << t.ns / R << ',' << t.bytes << '\n';
  file.close();
  if (!file) throw OutputError(path + ": could not be written: choose another --phases-csv file");
}

void drawPhases(const std::string& path, const std::vector<Phases>& sizes) {
  Chart chart;
  chart.title = "Steps of a bake";
  chart.subtitle = "one thread, clouds as `make cloud` has them";
  chart.x = {"active voxels", Scale::kLog};
  chart.y = {"ns per active voxel", Scale::kLog};
  std::map<std::string, Series> by_step;
  for (const Phases& p : sizes)
    for (const PhaseTime& t : p.times) {
      if (t.threads != 1 || t.name[0] == ' ') continue;
      Series& s = by_step[t.name.substr(0, t.name.find(" ("))];
      s.name = t.name.substr(0, t.name.find(" ("));
      s.marker = Marker::kDisc;
      s.x.push_back(static_cast<double>(p.voxels));
      s.y.push_back(t.ns);
    }
  for (auto& [name, series] : by_step) chart.series.push_back(std::move(series));
  const bool svg = path.size() > 4 && path.substr(path.size() - 4) == ".svg";
  std::ofstream file(path, std::ios::binary);
  file << drawChart(chart, svg ? PictureFormat::kSvg : PictureFormat::kPng);
  file.close();
  if (!file) throw OutputError(path + ": could not be written: choose another --plot file");
}

void writeCsv(const std::string& path, const std::vector<Comparison>& comparisons, double R) {
  std::ofstream file(path);
  file
      << "voxels,cap,R_ns,solver,threads,tolerance,iterations,setup_ns,solve_ns,total_ns,total_over_R,cpu_ns,"
         "bytes_per_voxel,residual,error\n";
  for (const Comparison& c : comparisons)
    for (const SolverTime& t : c.times)
      file << c.voxels << ',' << c.cap << ',' << R << ',' << t.solver << ',' << t.threads << ','
           << t.tolerance << ',' << t.iterations << ',' << t.setup << ',' << t.solve << ',' << t.total << ','
           << t.total / R << ',' << t.cpu << ',' << t.bytes_per_voxel << ',' << t.residual << ',' << t.error
           << '\n';
  file.close();
  if (!file) throw OutputError(path + ": could not be written: choose another --csv file");
}

}  // namespace vdb_diffuse::speed
