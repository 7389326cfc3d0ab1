#include "medium_reader.h"

#include <algorithm>
#include <sstream>

#include "grid/error.h"
#include "medium/blackbody.h"

namespace vdb_diffuse {
namespace {

/// Begins with the file what is told without.
template <typename Work>
auto naming(const VdbFile& file, const std::string& grid, const Work& work) {
  try {
    return work();
  } catch (const InputError& error) {
    throw InputError(file.path() + ": grid " + grid + ": " + error.what());
  }
}

Volume densityOf(const VdbFile& file, const MediumSettings& words, const ReadSettings& reading) {
  Volume density = file.readDensity(words.density.value_or(""), reading);
  file.forget(density.name);
  return density;
}

/// The density of one file on the voxels of the medium.
Volume partOf(const VdbFile& file, const MediumSettings& words, const Volume& density,
              const ReadSettings& reading) {
  return {density.name, density.topology, density.transform,
          file.readOnto(file.densityName(words.density.value_or("")), density, reading)};
}

std::string countOf(uint64_t voxels) {
  return std::to_string(voxels) + (voxels == 1 ? " voxel" : " voxels");
}

/// The albedo factors of one file on the voxels of its part of the medium.
Channels albedoOf(const VdbFile& file, const std::string& name, const Volume& density,
                  const ReadSettings& reading, std::vector<std::string>& warnings) {
  VdbFile::Factors factors = file.readFactorsOnto(name, density, reading);
  file.forget(name);
  const std::string start = file.path() + ": grid " + name + ": ";
  if (factors.clamped > 0)
    warnings.push_back(start + "is outside 0..1 in " + countOf(factors.clamped) + ", and clamped there");
  const size_t components = factors.channels.size();
  if (std::any_of(factors.background.begin(), factors.background.begin() + components,
                  [](float a) { return a < 1; }) &&
      factors.outside > 0) {
    std::ostringstream background;
    for (size_t c = 0; c < components; ++c) background << (c ? "," : "") << factors.background[c];
    warnings.push_back(start + "has no value in " + countOf(factors.outside) +
                       " of the density, which take its background " + background.str());
  }
  return std::move(factors.channels);
}

/// sum_i rho_i a_i / sum_i rho_i, as the parts of a medium each scatter by a_i sigma_s rho_i. A file without
/// the grid scatters as the words say; one at least must have it.
Channels albedoOfAll(const std::vector<const VdbFile*>& files, const MediumSettings& words,
                     const Volume& density, const ReadSettings& reading, std::vector<std::string>& warnings) {
  const std::string& name = *words.albedo_grid;
  Channels total(1, Field<float>(*density.topology));
  bool found = false;
  for (const VdbFile* file : files) {
    const Volume part = partOf(*file, words, density, reading);
    Channels a;
    if (file->has(name)) a = albedoOf(*file, name, part, reading, warnings);
    found = found || !a.empty();
    while (total.size() < a.size()) total.push_back(total.front());
    for (size_t c = 0; c < total.size(); ++c)
      forEachBlock(density.values.blockCount(), [&](size_t b) {
        const float* factor = a.empty() ? nullptr : a[a.size() == 1 ? 0 : c].block(b);
        for (int n = 0; n < kBlockVoxels; ++n)
          if (const float rho = density.values.block(b)[n]; rho > 0)
            total[c].block(b)[n] += (factor ? factor[n] : 1) * (part.values.block(b)[n] / rho);
      });
  }
  if (!found) files.front()->require(name);
  for (Field<float>& channel : total)  // rounding
    forEachBlock(channel.blockCount(), [&](size_t b) {
      for (int n = 0; n < kBlockVoxels; ++n) channel.block(b)[n] = std::min(channel.block(b)[n], 1.0f);
    });
  return total;
}

/// Q of one file on the voxels of the medium; empty where nothing glows.
Channels glowOf(const VdbFile& file, const MediumSettings& words, const Volume& density,
                const ReadSettings& reading) {
  const std::string& name = words.temperature ? *words.temperature : *words.emission;
  Field<float> values = file.readOnto(name, density, reading);
  file.forget(name);
  Channels Q;
  if (!words.temperature)
    Q.push_back(std::move(values));
  else
    Q = naming(file, name, [&] {
      return blackbodyField(values, words.temperature_scale.value_or(1),
                            words.blackbody_intensity.value_or(1));
    });
  return Q;
}

/// Of what a voxel of a medium emits, what a part of it does by an equal Q.
float shareOf(const Medium& part, const Medium& whole, int channel, size_t voxel) {
  const float of_density = part.density.values[voxel] / whole.density.values[voxel];
  if (whole.albedo.empty()) return of_density;
  const double absorbs = whole.absorptionIn(channel, voxel);
  return absorbs > 0 ? static_cast<float>(of_density * part.absorptionIn(channel, voxel) / absorbs) : 0;
}

/// sum_i sigma_a,i rho_i Q_i / sum_i sigma_a,i rho_i, as the parts of a medium each emit sigma_a,i rho_i Q_i.
/// A file without the grid is dark; one at least must have it. \param medium  but for its emission
Channels glowOfAll(const std::vector<const VdbFile*>& files, const MediumSettings& words,
                   const Medium& medium, const ReadSettings& reading) {
  const Volume& density = medium.density;
  const std::string& name = words.temperature ? *words.temperature : *words.emission;
  Channels total;
  for (const VdbFile* file : files) {
    if (!file->has(name)) continue;
    const Channels Q = glowOf(*file, words, density, reading);
    Medium own;  // of the file
    own.optics = medium.optics;
    own.density = partOf(*file, words, density, reading);
    std::vector<std::string> told;  // already
    if (!medium.albedo.empty() && file->has(*words.albedo_grid))
      own.albedo = albedoOf(*file, *words.albedo_grid, own.density, reading, told);
    total.resize(medium.albedo.empty() || (medium.greyOptics() && Q.size() == 1) ? Q.size() : 3);
    for (size_t c = 0; c < total.size(); ++c) {
      if (total[c].empty()) total[c] = Field<float>(*density.topology);
      forEachBlock(density.values.blockCount(), [&](size_t b) {
        for (int n = 0; n < kBlockVoxels; ++n)
          if (const float rho = density.values.block(b)[n]; rho > 0)
            total[c].block(b)[n] += Q[Q.size() == 1 ? 0 : c].block(b)[n] *
                                    shareOf(own, medium, static_cast<int>(c), b * kBlockVoxels + n);
      });
    }
  }
  if (total.empty()) files.front()->require(name);
  return total;
}

}  // namespace

Medium readMedium(const std::vector<const VdbFile*>& files, const MediumSettings& words,
                  const ReadSettings& reading, std::vector<std::string>& warnings) {
  Medium medium;
  medium.optics = opticsOf(words);
  medium.density = densityOf(*files.front(), words, reading);
  for (size_t n = 1; n < files.size(); ++n) {
    const Volume more = densityOf(*files[n], words, reading);
    medium.density = naming(*files[n], more.name, [&] { return sum(std::move(medium.density), more); });
  }
  medium.density = cut(std::move(medium.density), cutOf(words));
  if (words.albedo_grid)
    medium.albedo = files.size() == 1
                        ? albedoOf(*files.front(), *words.albedo_grid, medium.density, reading, warnings)
                        : albedoOfAll(files, words, medium.density, reading, warnings);
  if (words.emission || words.temperature)
    medium.emission = files.size() == 1 ? glowOf(*files.front(), words, medium.density, reading)
                                        : glowOfAll(files, words, medium, reading);
  if (words.temperature) medium.optics.emission_scale = 1;  // which is of the other kind of grid
  return medium;
}

}  // namespace vdb_diffuse
