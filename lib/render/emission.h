#pragma once

#include "grid/field.h"
#include "medium/medium.h"
#include "render/camera.h"

namespace vdb_diffuse {

/// A medium with the light in it, as `bake` leaves it. All fields stand on the density's topology.
struct LitVolume {
  Medium medium;
  Channels diffuse;  ///< mean over directions of the light that has scattered, W/m2/sr; empty: none
  Channels direct;   ///< likewise of the light that has not; empty: none
  VectorField flux;  ///< int I_d s dw (luminance where coloured), W/m2; empty: the scattering looks isotropic
};

/// Density of a voxel and the light that it sends toward the camera per unit length, W/m2/sr/length, in one
/// channel for grey light or three. Zero where inactive.
template <int kChannels>
struct VoxelLight {
  float rho;
  float emitted[kChannels];
};

/// Whether one channel describes both the medium and its light.
bool grey(const LitVolume& lit);

/// emitted = rho ( sigma_s max(0, direct + diffuse + g I1.s) + sigma_a Q ), I1 = 3 flux / (4 pi), sigma_s and
/// sigma_a those of the voxel, with s the
/// direction from the voxel's centre to the camera: S{I} of theory with p = 1 + 3 g s.s'. Where the light is
/// coloured, I1 takes the colour of `diffuse`, as flux is a luminance. `direct` counts as isotropic: its
/// first moment is not stored.
template <int kChannels>
Field<VoxelLight<kChannels>> emittedToward(const Camera& camera, const LitVolume& lit);

/// Rec. 709.
inline double luminance(const Vec3d& rgb) {
  return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

}  // namespace vdb_diffuse
