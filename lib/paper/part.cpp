#include "paper/part.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

namespace vdb_diffuse {

const std::vector<PaperPart>& paperParts() {
  static const std::vector<PaperPart> parts{
      {"fig1", "reduced incident against diffuse intensity, in a beam", reducedAndDiffuse},
      {"fig2", "the v-cycle, and multi-grid against relaxation", vCycleFigure},
      {"fig3", "a beam in a constant atmosphere: albedo, extinction, mu_bar", beamFigure},
      {"fig5", "Figs. 4 and 5: densities of blobs, by blobs and on the grid", blobFigure},
      {"compositing", "the formula of section 5.2", compositing},
      {"subsurface", "a thin slice of section 5.3", subsurface},
      {"map", "where the diffusion approximation is within 10 %", accuracyMap},
      {"smoothing", "appendix A: scattering smooths the dependence on direction", angularSmoothing}};
  return parts;
}

void PaperResult::add(const std::string& name, const Chart& chart) {
  files.emplace_back(name + ".svg", drawChart(chart, PictureFormat::kSvg));
  files.emplace_back(name + ".png", drawChart(chart, PictureFormat::kPng));
}

void PaperResult::add(const std::string& name, const PanelSheet& sheet) {
  files.emplace_back(name + ".svg", drawPanels(sheet, PictureFormat::kSvg));
  files.emplace_back(name + ".png", drawPanels(sheet, PictureFormat::kPng));
}

Progress under(const std::string& name, const Progress& progress) {
  if (!progress) return {};
  return [name, progress](std::string_view phase, double fraction) {
    progress(name + ": " + std::string(phase), fraction);
  };
}

void Csv::row(const std::vector<std::string>& cells) {
  for (size_t n = 0; n < cells.size(); ++n) {
    if (n > 0) text_ += ',';
    if (cells[n].find_first_of(",\"\n") == std::string::npos) {
      text_ += cells[n];
      continue;
    }
    text_ += '"';
    for (const char c : cells[n]) text_ += c == '"' ? std::string("\"\"") : std::string(1, c);
    text_ += '"';
  }
  text_ += '\n';
}

std::string number(double value, const char* format) {
  char text[48];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string percent(double fraction) {
  const double p = 100 * std::abs(fraction);
  return number(100 * fraction, p >= 10 ? "%.0f %%" : p >= 0.095 ? "%.2g %%" : "%.1g %%");
}

double secondsNow() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double secondsOf(const std::function<void()>& work) {
  std::vector<double> seconds;
  do {
    const double start = secondsNow();
    work();
    seconds.push_back(secondsNow() - start);
  } while (seconds.size() < 3 && seconds[0] < 1);
  std::sort(seconds.begin(), seconds.end());
  return seconds[seconds.size() / 2];
}

}  // namespace vdb_diffuse
