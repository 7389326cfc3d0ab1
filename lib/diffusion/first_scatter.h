#pragma once

#include "diffusion/model.h"
#include "grid/progress.h"
#include "scene/light_samples.h"
#include "scene/occluder.h"

namespace vdb_diffuse {

struct FirstScatterSettings {
  LightSampling lights;
  int rays_per_voxel = 9;    ///< of a beam that is not along a grid axis; many beams (a dome) take one each
  bool exact_march = false;  ///< march from every voxel to every light instead of sweeping along beams
  const std::vector<BlockMask>* only = nullptr;  ///< by block, the voxels to march from; null: all
  int gather_directions = 64;                    ///< in which a voxel looks for surfaces that reflect
  int phase_order = 1;      ///< 2: for transport, see channelOptics; fills `second_moments` where g is not 0
  bool want_flux = false;   ///< fill `direct_flux` even where the model does not need it
  bool want_shape = false;  ///< fill `shape`, which thick voxels need
  Progress progress;
};

/// Where in the voxels the beams are, along the grid's axes, x in voxels from a voxel's centre.
struct BeamShape {
  VectorField lean;    ///< mean of the light times x: the first moment
  VectorField spread;  ///< mean of the light times x^2 - 1/12: the second less that of even light
};

/// The uncollided light in every voxel, averaged over the voxel: I_ri0 = (1/4pi) int I_ri dw and the mean
/// (1/4pi) int I_ri s dw, the latter along the grid's axes. One channel where light and medium are grey, else
/// three. `beam` is the same light attenuated by the rescaled medium of delta-Eddington: Q0' = beam and
/// Q1' = 3 g' beam_flux.
struct FirstScatter {
  Channels direct;                       ///< I_ri0, W/m2/sr
  Channels beam;                         ///< empty where the model does not rescale: equal to `direct`
  std::vector<VectorField> beam_flux;    ///< by channel; empty where g' = 0 and no flux is wanted
  std::vector<VectorField> direct_flux;  ///< by channel; only for a wanted flux of a rescaled medium

  std::vector<BeamShape> shape;  ///< by channel, of `beam` or what stands for it; only if wanted

  /// By channel: means of the beams times b_3 .. b_7 of angular_basis.h along the grid's axes.
  std::vector<std::vector<Field<float>>> second_moments;

  const Field<float>& sourceOf(size_t channel) const {
    return beam.empty() ? direct[channel] : beam[channel];
  }
};

/// Beams are swept (beam_sweep.h), O(N) each. Lights at a finite distance are marched to from every voxel,
/// exact for constant voxels and O(N^(4/3)) for each of their samples; with `exact_march` all are. Light
/// reflected by surfaces is included.
FirstScatter firstScatter(const Medium& medium, const Scene& scene, const Occluder& occluder, Model model,
                          const FirstScatterSettings& settings = {});

}  // namespace vdb_diffuse
