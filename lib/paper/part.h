#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "grid/progress.h"
#include "paper/claim.h"
#include "plot/chart.h"
#include "plot/panels.h"

namespace vdb_diffuse {

/// The figures and claims of Stam (1995), measured: each part makes pictures, the numbers that they show, and
/// what they say about the paper's words.
struct PaperSettings {
  int relaxations = 3;  ///< of a v-cycle on each grid, as section 5.1 has it
  int depth = 0;        ///< grids of a v-cycle; 0: as many as can be halved. Section 5.1 has 5
  double effort = 1;    ///< factor on the paths of Monte Carlo; 1 is a run of some minutes, > 0
  Progress progress;
};

struct PaperResult {
  std::vector<std::pair<std::string, std::string>> files;  ///< name and bytes
  std::vector<Claim> claims;

  void add(const std::string& name, const Chart& chart);       ///< as SVG and PNG
  void add(const std::string& name, const PanelSheet& sheet);  ///< likewise
};

struct PaperPart {
  std::string name;   ///< on the command line
  std::string words;  ///< what it is, for the help
  PaperResult (*run)(const PaperSettings& settings);
};

/// All of them, in the order of the paper.
const std::vector<PaperPart>& paperParts();

PaperResult reducedAndDiffuse(const PaperSettings& settings);  ///< Fig. 1
PaperResult vCycleFigure(const PaperSettings& settings);       ///< Fig. 2 and section 4.1
PaperResult beamFigure(const PaperSettings& settings);         ///< Fig. 3 and section 5.1
PaperResult blobFigure(const PaperSettings& settings);         ///< Figs. 4 and 5, section 5.2
PaperResult compositing(const PaperSettings& settings);        ///< the formula of section 5.2
PaperResult subsurface(const PaperSettings& settings);         ///< section 5.3
PaperResult accuracyMap(const PaperSettings& settings);        ///< what section 6 leaves open
PaperResult angularSmoothing(const PaperSettings& settings);   ///< appendix A

/// The work's own phases, behind a name.
Progress under(const std::string& name, const Progress& progress);

/// Comma-separated values under a line of names. Text with commas or quotes is quoted.
class Csv {
 public:
  explicit Csv(const std::vector<std::string>& names) { row(names); }
  void row(const std::vector<std::string>& cells);
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

std::string number(double value, const char* format = "%.6g");
std::string percent(double fraction);  ///< "12 %", "0.34 %"

/// Seconds of a clock that never goes back.
double secondsNow();

/// The median of three runs' times; one run where that takes more than a second.
double secondsOf(const std::function<void()>& work);

}  // namespace vdb_diffuse
