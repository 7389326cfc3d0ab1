#include "cloud_system.h"

#include <limits>

#include "diffusion/returned_light.h"
#include "shapes/cloud.h"
#include "stopwatch.h"

namespace vdb_diffuse::speed {

double CloudSystem::fill() const {
  return static_cast<double>(voxels()) /
         static_cast<double>(medium.topology().blockCount() * size_t{kBlockVoxels});
}

Field<float> returnedLight(const Medium& medium, const ChannelOptics& optics) {
  const std::vector<Surface> none;
  const Occluder nothing(none);
  const Walls no_walls;
  return returnedLight(FaceProbe(medium, nothing, none, no_walls, offPlanes()), optics, 0);
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
  settings.returned = std::make_shared<const Field<float>>(returnedLight(system.medium, optics));
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
