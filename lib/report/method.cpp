#include "report/method.h"

namespace vdb_diffuse {

std::vector<Method> methods() {
  std::vector<Method> all;
  const auto add = [&](const std::string& name, const std::string& label, const std::string& series,
                       Model model, int sweeps) {
    Method method{name, label, series, {}, {}};
    method.settings.model.model = model;
    method.transport.sweeps = sweeps;
    all.push_back(std::move(method));
  };
  add("paper", "as printed", "paper", Model::kPaper, 0);
  add("p1", "plain P1", "p1", Model::kP1, 0);
  add("diffusion", "diffusion", "sweeps", Model::kDefault, 0);
  const int usual = TransportSettings().sweeps;
  for (const int sweeps : {1, 2, 4, 8}) {
    const std::string count = std::to_string(sweeps) + (sweeps == 1 ? " sweep" : " sweeps");
    if (sweeps == usual)
      add("default", "default, " + count, "sweeps", Model::kDefault, sweeps);
    else
      add("sweeps" + std::to_string(sweeps), count, "sweeps", Model::kDefault, sweeps);
  }
  return all;
}

DiffuseResult lightBy(const Method& method, const Medium& medium, const Scene& scene, double tolerance,
                      const Progress& progress) {
  DiffuseSettings settings = method.settings;
  settings.tolerance = tolerance;
  settings.progress = progress;
  return illuminate(medium, scene, settings, method.transport);
}

}  // namespace vdb_diffuse
