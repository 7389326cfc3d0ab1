#include <openvdb/Grid.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "example.h"
#include "grid/norms.h"
#include "io/vdb_reader.h"

namespace vdb_diffuse {
namespace {

constexpr char kDefinitions[] =
    "With d = A - B over the union of the active voxels (a grid's background where it has none), weights w "
    "(1 "
    "without --weight) and mean|B| = sum w|B| / sum w:\n"
    "  rel_rms      sqrt(sum w d^2 / sum w B^2), B's noise taken off in quadrature\n"
    "  noise        sqrt(sum w se^2 / sum w B^2), where B's file has a grid called as B's with _se; else 0;\n"
    "               with --block as much larger as `reference` has found neighbours to err together\n"
    "  bias         sum w d / sum w|B|\n"
    "  p50 p95 p99  what |d| / mean|B| does not exceed in that share of the weight\n"
    "  max, max_at  largest |d| / mean|B|, and its voxel (index coordinates; with --block the cell's "
    "lowest)\n"
    "  nonfinite    voxels left out because a value is not finite; within a limit there are none\n"
    "The components of a vector count as values of their own. All are fractions: 0.05 is 5 %. In JSON an "
    "infinite "
    "norm (B zero, A not) is null.\n"
    "Exit status: 0, or 1 outside a limit.";

struct CompareFlags {
  std::string a, b, weight;
  int block = 1;
  double max_rms = -1, max_abs = -1;  // negative: no limit
  bool json = false;
};

struct Place {
  std::string path, grid;
};

/// "FILE" or "FILE:GRID". A file that has the whole name wins, and a drive letter's colon does not count.
Place parsePlace(const std::string& text, const std::string& default_grid) {
  struct stat status;
  const size_t colon = text.rfind(':');
  const bool drive = colon == 1 && text.size() > 2 && (text[2] == '\\' || text[2] == '/');
  if (colon == std::string::npos || drive || ::stat(text.c_str(), &status) == 0) return {text, default_grid};
  if (colon == 0 || colon + 1 == text.size()) throw UsageError(text + ": FILE:GRID lacks one of the two");
  return {text.substr(0, colon), text.substr(colon + 1)};
}

/// By how much the errors of cells of `width` voxels exceed those of independent voxels: what `reference` has
/// measured for 2, 4 and 8, on a straight line between and beyond in logarithms; 1 where the grid does not
/// tell. At most as if all voxels of a cell erred as one.
double correlationOf(const openvdb::GridBase& standard_error, int width) {
  const double x = std::log2(width);
  double known[4] = {0, 0, 0, 0};  // logarithms for 1, 2, 4, 8
  for (int n = 1; n < 4; ++n) {
    const auto value =
        standard_error.getMetadata<openvdb::DoubleMetadata>("correlation_" + std::to_string(1 << n));
    if (!value || !(value->value() > 0)) return 1;
    known[n] = std::log2(value->value());
  }
  const int from = std::clamp(static_cast<int>(x), 0, 2);
  return std::exp2(std::min(known[from] + (x - from) * (known[from + 1] - known[from]), 1.5 * x));
}

void print(const Norms& norms, bool limited, bool within) {
  const auto percent = [](double v) {
    char text[40];
    std::snprintf(text, sizeof text, "%.4g %%", 100 * v);
    return std::string(text);
  };
  std::cout << "relative RMS  " << percent(norms.rel_rms);
  if (norms.noise > 0) std::cout << "  (noise of B, taken off: " << percent(norms.noise) << ")";
  std::cout << "\nbias          " << percent(norms.bias) << "\nmedian        " << percent(norms.p50)
            << "\np95           " << percent(norms.p95) << "\np99           " << percent(norms.p99)
            << "\nlargest       " << percent(norms.max) << "  at voxel " << norms.max_at << "\nmean of |B|   "
            << norms.mean << " over " << norms.samples << " values\nnot finite    " << norms.nonfinite
            << "\n";
  if (limited) std::cout << (within ? "within the tolerance\n" : "OUTSIDE the tolerance\n");
}

ExitStatus runCompare(const CompareFlags& flags) {
  const Place place_a = parsePlace(flags.a, "diffuse"), place_b = parsePlace(flags.b, "diffuse");
  const VdbFile file_a(place_a.path), file_b(place_b.path);
  const GridValues a = file_a.readValues(place_a.grid), b = file_b.readValues(place_b.grid);
  GridValues standard_error, weight;
  const bool noisy = file_b.has(place_b.grid + "_se");
  if (noisy) {
    standard_error = file_b.readValues(place_b.grid + "_se");
    const double factor = correlationOf(*file_b.readGrid(place_b.grid + "_se"), flags.block);
    for (Field<float>& channel : standard_error.channels)
      for (size_t i = 0; i < channel.size(); ++i) channel[i] *= static_cast<float>(factor);
  }
  if (!flags.weight.empty()) {
    const Place place = parsePlace(flags.weight, "");
    const VdbFile file(place.path);
    weight = file.readValues(file.densityName(place.grid));
  }
  Norms norms;
  try {
    norms = compareGrids(a, b, noisy ? &standard_error : nullptr, flags.weight.empty() ? nullptr : &weight,
                         flags.block);
  } catch (const InputError& error) {
    throw InputError(flags.a + ", " + flags.b + ": " + error.what());
  }
  const bool limited = flags.max_rms >= 0 || flags.max_abs >= 0;
  bool within = !limited || norms.nonfinite == 0;
  if (flags.max_rms >= 0) within = within && norms.rel_rms <= flags.max_rms;
  if (flags.max_abs >= 0) within = within && norms.max <= flags.max_abs;
  if (flags.json) {
    const nlohmann::ordered_json out = {{"rel_rms", norms.rel_rms},
                                        {"bias", norms.bias},
                                        {"p50", norms.p50},
                                        {"p95", norms.p95},
                                        {"p99", norms.p99},
                                        {"max", norms.max},
                                        {"max_at", {norms.max_at[0], norms.max_at[1], norms.max_at[2]}},
                                        {"noise", norms.noise},
                                        {"nonfinite", norms.nonfinite},
                                        {"within", within}};
    std::cout << out.dump(2) << "\n";
  } else {
    print(norms, limited, within);
  }
  return within ? ExitStatus::kDone : ExitStatus::kOutsideTolerance;
}

}  // namespace

void addCompare(CLI::App& program, ExitStatus& status) {
  CLI::App* command = program.add_subcommand("compare", "How far a grid is from a reference");
  const auto flags = std::make_shared<CompareFlags>();
  command->add_option("A", flags->a, "FILE or FILE:GRID; the grid is `diffuse` unless named")->required();
  command->add_option("B", flags->b, "the reference, likewise")->required();
  command->add_option("--weight", flags->weight,
                      "FILE or FILE:GRID of weights, >= 0; the grid is the density unless named");
  command->add_option("--block", flags->block, "compare weighted averages over cells of N^3 voxels")
      ->check(CLI::Range(1, 1 << 20))
      ->type_name("N")
      ->capture_default_str();
  command->add_option("--max-rms", flags->max_rms, "largest relative RMS that is within tolerance")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--max-abs", flags->max_abs, "largest `max` that is within tolerance")
      ->check(CLI::NonNegativeNumber);
  command->add_flag("--json", flags->json, "print JSON");
  setExample(
      command,
      std::string("vdb_diffuse compare lit.vdb reference.vdb --weight cloud.vdb:density --max-rms 0.05"));
  command->footer(std::string(kDefinitions) + "\n\n" + command->get_footer());
  command->callback([flags, &status] { status = runCompare(*flags); });
}

}  // namespace vdb_diffuse
