#include "transport/tints.h"

#include <algorithm>

#include "scene/colour.h"

namespace vdb_diffuse {
namespace {

constexpr size_t kMostTints = 2;

Field<float> times(const Field<float>& field, float factor) {
  Field<float> product = field;
  forEachBlock(product.blockCount(), [&](size_t b) {
    for (int n = 0; n < kBlockVoxels; ++n) product.block(b)[n] *= factor;
  });
  return product;
}

void tint(Channels& channels, const Vec3d& colour) {
  Channels three;
  for (int c = 0; c < 3; ++c) three.push_back(times(channels.front(), static_cast<float>(colour[c])));
  channels = std::move(three);
}

void addFields(const Channels& part, Channels& sum) {
  if (sum.size() < part.size()) tint(sum, Vec3d(1));
  for (size_t c = 0; c < sum.size(); ++c) {
    const Field<float>& more = part[part.size() == 1 ? 0 : c];
    forEachBlock(more.blockCount(), [&](size_t b) {
      for (int n = 0; n < kBlockVoxels; ++n) sum[c].block(b)[n] += more.block(b)[n];
    });
  }
}

}  // namespace

std::vector<TintedLight> splitByTint(const Medium& medium, const std::vector<Surface>& surfaces,
                                     const LightGroup& group) {
  if (!medium.greyOptics() || greyLights(group.lights) || !greySurfaces(surfaces)) return {};
  if (group.emission && medium.emission.size() > 1) return {};
  std::vector<TintedLight> tints;
  const auto of = [&](const Vec3d& tint) -> LightGroup& {
    for (TintedLight& t : tints)
      if (t.tint == tint) return t.grey;
    tints.push_back({tint, {group.name, {}, false}});
    return tints.back().grey;
  };
  for (NamedLight named : group.lights) {
    if (hasColouredImage(named.light)) return {};
    Vec3d& strength = strengthOf(named.light);
    const double most = std::max({strength[0], strength[1], strength[2]});
    if (!(most > 0)) continue;
    const Vec3d colour = strength / most;
    strength = Vec3d(most);
    of(colour).lights.push_back(std::move(named));
  }
  if (group.emission && !medium.emission.empty()) of(Vec3d(1)).emission = true;
  if (tints.size() > kMostTints) return {};
  return tints;
}

DiffuseResult tinted(DiffuseResult grey, const Vec3d& colour) {
  tint(grey.diffuse, colour);
  tint(grey.direct, colour);
  double luminance = 0;
  for (int c = 0; c < 3; ++c) luminance += kLuminance[c] * colour[c];
  for (Field<float>& component : grey.flux)
    if (!component.empty()) component = times(component, static_cast<float>(luminance));
  Energy& energy = grey.energy;
  for (double* power : {&energy.scattered_in, &energy.emitted, &energy.absorbed, &energy.escaped})
    *power *= luminance;
  return grey;
}

void add(const DiffuseResult& part, DiffuseResult& sum) {
  addFields(part.diffuse, sum.diffuse);
  addFields(part.direct, sum.direct);
  for (int a = 0; a < 3; ++a)
    forEachBlock(sum.flux[a].blockCount(), [&](size_t b) {
      for (int n = 0; n < kBlockVoxels; ++n) sum.flux[a].block(b)[n] += part.flux[a].block(b)[n];
    });
  sum.energy.scattered_in += part.energy.scattered_in;
  sum.energy.emitted += part.energy.emitted;
  sum.energy.absorbed += part.energy.absorbed;
  sum.energy.escaped += part.energy.escaped;
  sum.converged = sum.converged && part.converged;
  sum.iterations = std::max(sum.iterations, part.iterations);
  sum.relative_residual = std::max(sum.relative_residual, part.relative_residual);
  sum.levels = std::max(sum.levels, part.levels);
  sum.sweeps = std::max(sum.sweeps, part.sweeps);
  if (part.estimated_error)
    sum.estimated_error = std::max(sum.estimated_error.value_or(0), *part.estimated_error);
  sum.negative_voxels += part.negative_voxels;
  sum.most_negative = std::max(sum.most_negative, part.most_negative);
  sum.seconds_source += part.seconds_source;
  sum.seconds_setup += part.seconds_setup;
  sum.seconds_solve += part.seconds_solve;
  sum.seconds_sweeps += part.seconds_sweeps;
  for (const std::string& warning : part.warnings) addOnce(warning, sum.warnings);
}

}  // namespace vdb_diffuse
