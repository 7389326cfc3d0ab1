#include "transport/voxel_slopes.h"

#include <algorithm>

namespace vdb_diffuse {
namespace {

/// Optical depths of a voxel up to which the equation's slope is the better one, and from which on the swept.
constexpr float kThin = 0.5, kThick = 2;

float sweptPart(float tau) {
  return std::clamp((tau - kThin) / (kThick - kThin), 0.0f, 1.0f);
}

/// Of a slope of the light in a voxel, the part that is there again after one collision, for light that comes
/// in from nowhere: a slab's, within 6 % from tau = 0.3 on.
double slopeThatStays(double tau) {
  return tau / (tau + 1.6 + 1 / (0.3 + tau));
}

/// How far a slope goes at once of the way that it would go by itself; all of it overshoots in three
/// dimensions.
constexpr double kAtOnce = 0.5;

/// Optical depth of a voxel of density 1.
double extinctionAt(const ChannelSolution& channel, size_t b, int n) {
  return channel.equation.optics.at(b, n).sigma_t_beam * channel.equation.h;
}

VectorField ofEquation(const ChannelSolution& channel, const Medium& medium) {
  VectorField slope;
  for (Field<float>& component : slope) component = Field<float>(medium.topology());
  diffusiveFlux(channel.equation, medium, channel.I0, channel.beams, nullptr, &slope);
  return slope;
}

}  // namespace

VoxelSlopes::VoxelSlopes(const ChannelSolution& channel, const Medium& medium) {
  const size_t thick = sumOverBlocks<size_t>(medium.topology().blockCount(), [&](size_t b) {
    const float* rho = medium.density.values.block(b);
    size_t count = 0;
    for (int n = 0; n < kBlockVoxels; ++n)
      count += sweptPart(static_cast<float>(extinctionAt(channel, b, n)) * rho[n]) > 0;
    return count;
  });
  of_equation_ = thick > 0;
  if (of_equation_) own_ = ofEquation(channel, medium);
}

const VectorField& VoxelSlopes::now(const ChannelSolution& channel, const Medium& medium,
                                    VectorField& slope) const {
  if (of_equation_) return own_;
  slope = ofEquation(channel, medium);
  if (!needsSwept()) return slope;
  forEachBlock(medium.topology().blockCount(), [&](size_t b) {
    const float* rho = medium.density.values.block(b);
    for (auto it = medium.topology().active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      const float part = sweptPart(static_cast<float>(extinctionAt(channel, b, n)) * rho[n]);
      for (int a = 0; a < 3; ++a) {
        float& value = slope[a].block(b)[n];
        value += part * (own_[a].block(b)[n] - value);
      }
    }
  });
  return slope;
}

void VoxelSlopes::update(const ChannelSolution& channel, const Medium& medium, const VectorField& swept,
                         const VectorField& correction) {
  of_equation_ = false;
  forEachBlock(medium.topology().blockCount(), [&](size_t b) {
    const float* rho = medium.density.values.block(b);
    for (auto it = medium.topology().active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      // A slope scatters into itself within a thick voxel, and alone would take many sweeps to settle.
      const double albedo = channel.equation.optics.at(b, n).albedo();
      const double stays = albedo * slopeThatStays(extinctionAt(channel, b, n) * rho[n]),
                   onward = kAtOnce * stays / (1 - stays);
      for (int a = 0; a < 3; ++a) {
        float& slope = own_[a].block(b)[n];
        const double found = swept[a].block(b)[n];
        slope = static_cast<float>(found + onward * (found - slope) + correction[a].block(b)[n]);
      }
    }
  });
}

}  // namespace vdb_diffuse
