#include "report/method.h"

namespace vdb_diffuse {

std::vector<Method> methods() {
  const auto diffusion = [](const char* name, const char* label, Model model) {
    Method method{name, label, name, {}};
    method.settings.model.model = model;
    return method;
  };
  return {diffusion("paper", "as printed", Model::kPaper), diffusion("p1", "plain P1", Model::kP1),
          diffusion("default", "default", Model::kDefault)};
}

DiffuseResult lightBy(const Method& method, const Medium& medium, const Scene& scene, double tolerance,
                      const Progress& progress) {
  DiffuseSettings settings = method.settings;
  settings.tolerance = tolerance;
  settings.progress = progress;
  return diffuse(medium, scene, settings);
}

}  // namespace vdb_diffuse
