// The hard cases in one table: each is solved by diffusion alone and with four transport sweeps, some by
// blobs and by the path tracer as well. Status 1 where a row does not hold what it must.
//
//   vdb_diffuse_hard [WORD]        only cases whose names hold the word
#include <chrono>
#include <cmath>
#include <cstdio>

#include "blobs/blob_light.h"
#include "grid/error.h"
#include "hard/hard_cases.h"
#include "reference/path_tracer.h"
#include "transport/illuminate.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

constexpr double kMostSeconds = 20;  // of any row, on a machine with other work

struct Row {
  std::string faults;
  int iterations = 0;
  double residual = 0, closure = 0, least = 0, seconds = 0;

  void expect(bool holds, const std::string& otherwise) {
    if (!holds) faults += (faults.empty() ? "" : "; ") + otherwise;
  }
};

/// Least value over all active voxels and channels; NaN where one is not finite.
double leastOf(const Topology& topology, const Channels& light) {
  double least = HUGE_VAL;
  for (const Field<float>& channel : light)
    forEachVoxel(topology, [&](Coord, size_t i) {
      if (!std::isfinite(channel[i])) least = NAN;
      if (!(channel[i] >= least)) least = std::isnan(least) ? NAN : channel[i];
    });
  return least;
}

void hold(Row& row, const Medium& medium, const Channels& diffuse, const Channels& direct) {
  const double direct_least = leastOf(medium.topology(), direct);
  row.least = leastOf(medium.topology(), diffuse);
  row.expect(std::isfinite(row.least) && std::isfinite(direct_least), "not finite");
  row.expect(!(row.least < 0) && !(direct_least < 0), "negative light");
  row.expect(row.seconds <= kMostSeconds, "took too long");
}

void holdSolve(Row& row, const HardCase& hard, const DiffuseResult& result) {
  hold(row, hard.medium, result.diffuse, result.direct);
  row.iterations = result.iterations;
  row.residual = result.relative_residual;
  row.closure = result.energy.closure();
  row.expect(result.converged, "not converged");
  row.expect(row.residual <= hard.tolerance, "residual above the tolerance");
  row.expect(std::abs(row.closure) <= 10 * hard.tolerance, "energy does not close");
}

DiffuseSettings settingsOf(const HardCase& hard) {
  DiffuseSettings settings;
  settings.model.model = hard.model;
  settings.tolerance = hard.tolerance;
  return settings;
}

Row bySweeps(const HardCase& hard, int sweeps) {
  TransportSettings transport;
  transport.sweeps = sweeps;
  Row row;
  const DiffuseResult result = illuminate(hard.medium, hard.scene, settingsOf(hard), transport);
  holdSolve(row, hard, result);
  row.expect(result.iterations <= hard.most_iterations * (1 + sweeps), "more iterations than allowed");
  if (result.negative_voxels > 0) row.least = -result.most_negative;
  double largest = 0;
  for (const Field<float>& channel : result.diffuse)
    for (size_t i = 0; i < channel.size(); ++i) largest = std::max<double>(largest, channel[i]);
  row.expect(result.most_negative <= hard.negatives * largest,
             std::to_string(result.negative_voxels) + " voxels were negative");
  if (sweeps == 0 && hard.holds) row.expect(hard.holds(result), "not so: " + hard.criterion);
  return row;
}

Row byBlobs(const HardCase& hard) {
  BlobSettings blobs;
  blobs.count = 50;
  Row row;
  holdSolve(row, hard, blobLight(hard.medium, hard.scene, settingsOf(hard), blobs));
  return row;
}

Row byPaths(const HardCase& hard) {
  ReferenceSettings settings;
  settings.samples = 2000;
  Row row;
  const ReferenceResult result = reference(hard.medium, hard.scene, settings);
  hold(row, hard.medium, result.diffuse, result.direct);
  row.closure = result.energy.closure();
  row.expect(std::abs(row.closure) <= 1e-9, "energy does not close");
  row.expect(result.energy.lost == 0, "paths were given up");
  return row;
}

/// Runs one row and prints it; whether it holds.
template <typename Solve>
bool print(const HardCase& hard, const char* method, const Solve& solve) {
  const auto start = std::chrono::steady_clock::now();
  Row row;
  try {
    row = solve();
    row.expect(!hard.refused, "not refused");
  } catch (const InputError& error) {
    row.expect(hard.refused, std::string("refused: ") + error.what());
  }
  row.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  row.expect(row.seconds <= kMostSeconds, "took too long");
  const std::string criterion = hard.criterion.empty() ? "" : ", " + hard.criterion;
  std::printf("%-42s %-6s %5d %9.1e %9.1e %9.2e %6.2f  %s\n", hard.name.c_str(), method, row.iterations,
              row.residual, row.closure, row.least, row.seconds,
              row.faults.empty() ? ("ok" + criterion).c_str() : ("FAIL " + row.faults).c_str());
  std::fflush(stdout);
  return row.faults.empty();
}

int run(const std::string& word) {
  int rows = 0, failed = 0;
  std::printf("%-42s %-6s %5s %9s %9s %9s %6s\n", "case", "method", "iter.", "residual", "closure", "least",
              "s");
  for (const HardCase& hard : hardCases()) {
    if (hard.name.find(word) == std::string::npos) continue;
    const auto count = [&](bool holds) {
      ++rows;
      failed += !holds;
    };
    count(print(hard, "K = 0", [&] { return bySweeps(hard, 0); }));
    count(print(hard, "K = 4", [&] { return bySweeps(hard, 4); }));
    if (!hard.others) continue;
    count(print(hard, "blobs", [&] { return byBlobs(hard); }));
    count(print(hard, "paths", [&] { return byPaths(hard); }));
  }
  std::printf("%d rows, %d failed\n", rows, failed);
  return failed ? 1 : 0;
}

}  // namespace
}  // namespace vdb_diffuse

int main(int argc, char** argv) {
  return vdb_diffuse::run(argc > 1 ? argv[1] : "");
}
