#pragma once

#include "diffusion/diffuse.h"

namespace vdb_diffuse {

/// Light of one colour, as grey light and the factor that its red, green and blue have on it.
struct TintedLight {
  Vec3d tint;
  LightGroup grey;
};

/// A group's light by colour, where solving for each colour costs less than for red, green and blue: in a
/// grey medium among grey surfaces, with at most two colours and no coloured picture. Else empty, as for
/// light that is grey already.
std::vector<TintedLight> splitByTint(const Medium& medium, const std::vector<Surface>& surfaces,
                                     const LightGroup& group);

/// Three channels of a grey result times a colour.
DiffuseResult tinted(DiffuseResult grey, const Vec3d& tint);

/// The light of several results together: fields add, and of numbers that tell how well it went the worst
/// counts. One channel counts as three equal ones where the other has three.
void add(const DiffuseResult& part, DiffuseResult& sum);

}  // namespace vdb_diffuse
