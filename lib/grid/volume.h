#pragma once

#include <memory>
#include <string>

#include "grid/field.h"
#include "grid/transform.h"

namespace vdb_diffuse {

/// A sparse scalar grid with its place in the world. Inactive voxels of `values` hold zero. The topology is
/// shared, so that further fields of the same voxels cost nothing twice.
struct Volume {
  std::string name = "density";
  std::shared_ptr<const Topology> topology = std::make_shared<Topology>();
  Transform transform;
  Field<float> values;
};

}  // namespace vdb_diffuse
