#include "report/method.h"

namespace vdb_diffuse {

std::vector<Method> methods() {
  std::vector<Method> all;
  const auto add = [&](const std::string& name, const std::string& label, const std::string& series,
                       Model model, int sweeps) {
    Method method{name, label, series, {}, {}, {}};
    method.settings.model.model = model;
    method.transport.sweeps = sweeps;
    all.push_back(std::move(method));
  };
  const auto addBlobs = [&](const std::string& name, const std::string& label, int count, bool at_centres) {
    add(name, label, "blobs", Model::kDefault, 0);
    all.back().blobs.emplace();
    all.back().blobs->count = count;
    all.back().blobs->source_at_centres = at_centres;
    all.back().blobs->want_direct = false;
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
  addBlobs("blob-centres", "200 blobs, lit at centres", 200, true);
  addBlobs("blobs", "200 blobs", 200, false);
  addBlobs("blobs1000", "1000 blobs", 1000, false);
  return all;
}

DiffuseResult lightBy(const Method& method, const Medium& medium, const Scene& scene, double tolerance,
                      const Progress& progress) {
  DiffuseSettings settings = method.settings;
  settings.tolerance = tolerance;
  settings.progress = progress;
  if (method.blobs) return blobLight(medium, scene, settings, *method.blobs);
  return illuminate(medium, scene, settings, method.transport);
}

}  // namespace vdb_diffuse
