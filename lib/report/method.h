#pragma once

#include <string>
#include <vector>

#include "blobs/blob_light.h"
#include "transport/illuminate.h"

namespace vdb_diffuse {

/// A way to compute the light that gives the same every time: a point in the picture.
struct Method {
  std::string name;    ///< on the command line and in the table
  std::string label;   ///< beside its point
  std::string series;  ///< points of one series are joined, in the order of the list
  DiffuseSettings settings;
  TransportSettings transport;
  std::optional<BlobSettings> blobs;  ///< then by these, not by multigrid
};

/// All of them, by series, cheapest first. What is added here can be chosen, is measured and is drawn.
std::vector<Method> methods();

/// The light by one of them.
DiffuseResult lightBy(const Method& method, const Medium& medium, const Scene& scene, double tolerance,
                      const Progress& progress);

}  // namespace vdb_diffuse
