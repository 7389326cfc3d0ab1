#pragma once

#include "diffusion/model.h"

namespace vdb_diffuse {

/// Optical depth of a voxel, by sigma_t_beam: the mean over those that are not empty or weighted
/// by density; as well weighted, its depth by sigma_tr, and the part of its optical depth that scatters.
struct MeanDepth {
  double plain = 0, by_density = 0, transport = 0, albedo = 0;
};

MeanDepth meanDepth(const Medium& medium, const ChannelOptics& optics);
/// Of the densest voxel, by sigma_t_beam.
double mostDepth(const Medium& medium, const ChannelOptics& optics);

/// Voxels of at most this optical depth scatter a beam evenly; in thicker ones the equation asks where.
constexpr double kThinVoxel = 0.3;

}  // namespace vdb_diffuse
