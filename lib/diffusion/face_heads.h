#pragma once

#include "diffusion/equation.h"

namespace vdb_diffuse {

/// The way from a times a voxel's mean to its upper and its lower face along an axis: what the drive and the
/// sources inside add, see equation.h. Zero in inactive voxels.
struct FaceHeads {
  Field<float> upper, lower;
};

/// \param I0  means, of which heads take what is missing from a times them to themselves; null: 0
void formFaceHeads(const Equation& e, const Medium& medium, const BeamSource& beams, const Field<double>* I0,
                   int axis, FaceHeads& heads);

}  // namespace vdb_diffuse
