#include "report_table.h"

#include <cmath>
#include <cstdio>

namespace vdb_diffuse {
namespace {

std::string text(const char* format, double value) {
  char out[48];
  std::snprintf(out, sizeof out, format, value);
  return out;
}

std::string number(double value) {
  return text("%.6g", value);
}

std::string percent(double fraction) {
  return std::isfinite(fraction) ? text(std::abs(fraction) < 0.01 ? "%.2g %%" : "%.3g %%", 100 * fraction)
                                 : "-";
}

std::string seconds(double s) {
  return text(s < 0.1 ? "%.2g s" : "%.3g s", s);
}

/// Columns as wide as their widest cell, the first two to the left; widths count characters, not bytes.
std::string aligned(const std::vector<std::vector<std::string>>& lines) {
  std::vector<size_t> width;
  for (const auto& line : lines)
    for (size_t c = 0; c < line.size(); ++c) {
      if (c == width.size()) width.push_back(0);
      width[c] = std::max(width[c], line[c].size());
    }
  std::string out;
  for (const auto& line : lines) {
    std::string row;
    for (size_t c = 0; c < line.size(); ++c) {
      const std::string space(width[c] - line[c].size(), ' ');
      row += (c > 0 ? "  " : "") + (c < 2 ? line[c] + space : space + line[c]);
    }
    row.erase(row.find_last_not_of(' ') + 1);
    out += row + "\n";
  }
  return out;
}

bool ownBlocks(int block) {
  return block != 1 && block != 4;
}

}  // namespace

std::string reportCsv(const std::vector<Measurement>& rows, int block, int threads) {
  std::string out = "quantity,method,setting,seconds,rel_rms,rel_rms_blocks4" +
                    (ownBlocks(block) ? ",rel_rms_blocks" + std::to_string(block) : std::string()) +
                    ",bias,p50,p95,p99,max,noise,nonfinite,samples,iterations,converged,closure,negative_"
                    "voxels,estimated_error,"
                    "monte_carlo_seconds,times_faster,extrapolated,repeats,threads,values\n";
  for (const Measurement& row : rows) {
    const Norms& e = row.errors.voxels;
    out += row.quantity + "," + row.method + "," + row.setting + "," + number(row.seconds);
    const bool judged = row.method != "reference";
    const auto error = [&](double value) { out += "," + (judged ? number(value) : std::string()); };
    error(e.rel_rms);
    error(row.errors.blocks4.rel_rms);
    if (ownBlocks(block)) error(row.errors.blocks.rel_rms);
    for (const double value : {e.bias, e.p50, e.p95, e.p99, e.max}) error(value);
    out += "," + number(e.noise) + "," + std::to_string(e.nonfinite);
    out += "," + (row.samples ? std::to_string(row.samples) : std::string());
    out += "," + (row.iterations ? std::to_string(*row.iterations) : std::string());
    out += "," + (row.iterations ? std::string(row.converged ? "1" : "0") : std::string());
    out += "," + (row.closure ? number(*row.closure) : std::string());
    out += "," + (row.iterations ? std::to_string(row.negative_voxels) : std::string());
    out += "," + (row.estimated_error ? number(*row.estimated_error) : std::string());
    if (row.monte_carlo)
      out += "," + number(row.monte_carlo->seconds) + "," + number(row.monte_carlo->seconds / row.seconds) +
             "," + (row.monte_carlo->extrapolated ? "1" : "0");
    else
      out += ",,,";
    out += "," + std::to_string(row.repeats) + "," + std::to_string(threads) + "," +
           std::to_string(e.samples) + "\n";
  }
  return out;
}

std::string reportTable(const std::vector<Measurement>& rows, int block) {
  const std::string on_blocks = "on " + std::to_string(block) + "^3";
  std::vector<std::vector<std::string>> lines{{"method", "", "time", "error", "on 4^3"}};
  if (ownBlocks(block)) lines[0].push_back(on_blocks);
  for (const char* name : {"bias", "p95", "largest", "iterations", "Monte Carlo", "ratio"})
    lines[0].push_back(name);
  for (const Measurement& row : rows) {
    const std::string quantity = row.quantity == "diffuse" ? "" : row.quantity + " ";
    if (row.method == "reference") {
      lines.push_back(
          {row.method, row.setting, seconds(row.seconds), "noise " + percent(row.errors.voxels.noise)});
      continue;
    }
    lines.push_back({quantity + row.method, row.setting, seconds(row.seconds),
                     percent(row.errors.voxels.rel_rms), percent(row.errors.blocks4.rel_rms)});
    std::vector<std::string>& line = lines.back();
    if (ownBlocks(block)) line.push_back(percent(row.errors.blocks.rel_rms));
    for (const double value : {row.errors.voxels.bias, row.errors.voxels.p95, row.errors.voxels.max})
      line.push_back(percent(value));
    line.push_back(row.iterations ? std::to_string(*row.iterations) : "");
    if (!row.monte_carlo) continue;
    line.push_back((row.monte_carlo->extrapolated ? "~ " : "") + seconds(row.monte_carlo->seconds));
    line.push_back(text("%.3g x", row.monte_carlo->seconds / row.seconds));
  }
  return aligned(lines);
}

std::string reportVerdict(const std::vector<Measurement>& rows, int block, const std::string& featured) {
  const Measurement* best = nullptr;
  for (const Measurement& row : rows) {
    if (row.method == featured && row.quantity == "diffuse" && row.errors.blocks.rel_rms == 0)
      return row.method +
             " is nearer to the reference than the reference's noise shows; a smaller --noise would";
    if (row.monte_carlo && !(best && best->method == featured)) best = &row;
  }
  if (!best) return "";
  const EqualError& equal = *best->monte_carlo;
  return best->method + " reaches " + percent(best->errors.blocks.rel_rms) + " in " + seconds(best->seconds) +
         "; Monte Carlo needs " + seconds(equal.seconds) + (equal.extrapolated ? " (extrapolated)" : "") +
         " for the same error " +
         (block == 1 ? "per voxel" : "on blocks of " + std::to_string(block) + "^3 voxels") + ": " +
         text("%.3g x", equal.seconds / best->seconds);
}

}  // namespace vdb_diffuse
