#include "table.h"

#include <cmath>
#include <cstdio>
#include <fstream>

#include "grid/error.h"

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
        "hypre / ours to %.0e: %.2f (%.2f to %.2f), by processor time %.2f; their solutions differ by %.1e "
        "of the largest\n",
        r.tolerance, r.median, r.lowest, r.highest, r.cpu, r.difference);
  std::fflush(stdout);
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
