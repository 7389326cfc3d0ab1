#include "lit_volume.h"

#include <openvdb/Grid.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "grid/error.h"
#include "medium_reader.h"

namespace vdb_diffuse {
namespace {

/// A value that `bake` stored, if it did.
template <typename Value>
std::optional<Value> stored(const openvdb::MetaMap& metadata, const std::string& name) {
  const auto item = metadata.getMetadata<openvdb::TypedMetadata<Value>>(name);
  return item ? std::optional<Value>(item->value()) : std::nullopt;
}

std::optional<std::string> storedName(const openvdb::MetaMap& metadata, const std::string& name) {
  const auto text = stored<std::string>(metadata, name);
  return text && !text->empty() ? text : std::nullopt;
}

std::optional<Vec3d> storedRgb(const openvdb::MetaMap& metadata, const std::string& name) {
  const auto r = stored<double>(metadata, name + "_r"), g = stored<double>(metadata, name + "_g"),
             b = stored<double>(metadata, name + "_b");
  return r && g && b ? std::optional<Vec3d>(Vec3d(*r, *g, *b)) : std::nullopt;
}

/// The medium that the light was baked for, with what the user says instead.
MediumSettings mediumOf(const openvdb::MetaMap& metadata, const MediumSettings& said) {
  MediumSettings medium = said;
  const auto fill = [](auto& setting, const auto& value) {
    if (!setting) setting = value;
  };
  fill(medium.density, storedName(metadata, "density"));
  fill(medium.albedo_grid, storedName(metadata, "albedo_grid"));
  if (!said.emission && !said.temperature) {
    medium.emission = storedName(metadata, "emission");
    medium.temperature = storedName(metadata, "temperature");
  }
  fill(medium.temperature_scale, stored<double>(metadata, "temperature_scale"));
  fill(medium.blackbody_intensity, stored<double>(metadata, "blackbody_intensity"));
  fill(medium.emission_scale, stored<double>(metadata, "emission_scale"));
  fill(medium.sigma_s, storedRgb(metadata, "sigma_s"));
  fill(medium.sigma_a, storedRgb(metadata, "sigma_a"));
  fill(medium.g, stored<double>(metadata, "g"));
  return medium;
}

void checkOptics(const std::string& path, const MediumSettings& said) {
  const Optics optics = opticsOf(said);
  bool good = std::abs(optics.g) < 1;
  for (const auto& factor : {said.emission_scale, said.temperature_scale, said.blackbody_intensity})
    good &= std::isfinite(factor.value_or(1)) && factor.value_or(1) >= 0;
  for (int c = 0; c < 3; ++c)
    for (const double sigma : {optics.sigma_s[c], optics.sigma_a[c]})
      good &= std::isfinite(sigma) && sigma >= 0;
  if (!good)
    throw InputError(path + ": the stored medium is out of range; give --sigma-s, --sigma-a and --g");
}

}  // namespace

LitVolume readLitVolume(const std::string& path, const LitVolumeSettings& settings,
                        std::vector<std::string>& warnings) {
  const VdbFile file(path);
  const std::string cure = "bake it with --grids density,diffuse,direct, or choose others with --light";
  if (settings.diffuse) file.require("diffuse", cure);
  if (settings.direct) file.require("direct", cure);
  MediumSettings said = mediumOf(*file.readGrid(settings.diffuse ? "diffuse" : "direct"), settings.medium);

  LitVolume lit;
  Medium& medium = lit.medium;
  checkOptics(path, said);
  const std::string density = said.density.value_or("density");
  file.require(density, "name another with --density, or bake with --grids density,diffuse,direct");
  std::optional<std::string>& glow = said.temperature ? said.temperature : said.emission;
  if (glow && !settings.medium.emission && !settings.medium.temperature && !file.has(*glow)) {
    warnings.push_back(path + ": no grid " + *glow +
                       ": the volume's own glow is not shown; bake with --keep " + *glow);
    glow.reset();
  }
  if (said.albedo_grid && !settings.medium.albedo_grid && !file.has(*said.albedo_grid)) {
    warnings.push_back(path + ": no grid " + *said.albedo_grid +
                       ": the volume is shown without its own colours; bake with --keep " +
                       *said.albedo_grid);
    said.albedo_grid.reset();
  }
  said.density = density;
  medium = readMedium({&file}, said, settings.read, warnings);
  if (medium.topology().activeVoxelCount() == 0)
    throw InputError(path + ": grid " + density + ": has no active voxels: there is nothing to see");
  const auto values = [&](const std::string& name) {
    return file.readChannelsOnto(name, medium.density, settings.read);
  };
  if (settings.diffuse) lit.diffuse = values("diffuse");
  if (settings.direct) lit.direct = values("direct");

  if (medium.optics.g != 0 && settings.diffuse) {
    if (file.has("flux")) {
      Channels flux = values("flux");
      if (flux.size() != 3) throw InputError(path + ": grid flux: holds no vectors; bake it again");
      std::move(flux.begin(), flux.end(), lit.flux.begin());
    } else {
      warnings.push_back(path +
                         ": no grid flux: scattering looks isotropic though g is not 0; bake with --grids "
                         "density,diffuse,direct,flux");
    }
  }
  return lit;
}

}  // namespace vdb_diffuse
