#include "cloud_system.h"

#include <limits>

#include "shapes/cloud.h"
#include "stopwatch.h"

namespace vdb_diffuse::speed {

double CloudSystem::fill() const {
  return static_cast<double>(voxels()) /
         static_cast<double>(medium.topology().blockCount() * size_t{kBlockVoxels});
}

CloudSystem makeCloudSystem(size_t voxels, bool raw) {
  CloudSystem system;
  CloudSettings cloud;
  cloud.size.voxels = voxels;
  system.medium.density = makeCloud(cloud);

  const Model model = Model::kDefault;
  ModelSettings model_settings;
  if (raw) model_settings.mean_free_path_cap = std::numeric_limits<double>::infinity();
  EquationSettings settings;
  settings.cap = meanFreePathCap(model_settings, system.medium);
  const ChannelOptics optics = channelOptics(system.medium.optics, 0, model);
  const Stopwatch watch;
  system.equation = formEquation(system.medium, optics, 0, model, settings);
  system.seconds_equation = watch.read().wall;

  Scene scene;
  scene.lights.push_back({"sun", SunLight{}});
  const FirstScatter light = firstScatter(system.medium, scene, Occluder(scene.surfaces), model);
  system.b = formRightHandSide(system.equation, system.medium, {&light.sourceOf(0)}).b;
  return system;
}

}  // namespace vdb_diffuse::speed
