#pragma once

#include <functional>
#include <string>
#include <vector>

#include "diffusion/diffuse.h"

namespace vdb_diffuse {

/// A medium and a light that are hard on a solver, and what must come out beside what every case is held to:
/// all values finite and not negative, the residual and the energy within their tolerances.
struct HardCase {
  std::string name;
  Medium medium;
  Scene scene;
  std::string criterion;  ///< in words, of `holds`; empty: none beside what holds for all
  /// Beside the general criteria, of a diffusion solve alone (K = 0) by `model`.
  std::function<bool(const DiffuseResult&)> holds = {};
  Model model = Model::kDefault;
  int most_iterations = 60;
  bool refused = false;     ///< an InputError is what must come
  double negatives = 1e-6;  ///< how far below zero voxels may come before they are clamped, of the largest
  bool others = false;      ///< blobs and the path tracer are tried as well
  double tolerance = 1e-4;  ///< of the solve
};

std::vector<HardCase> hardCases();

}  // namespace vdb_diffuse
