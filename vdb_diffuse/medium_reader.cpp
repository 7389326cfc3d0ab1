#include "medium_reader.h"

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

/// sum_i rho_i Q_i / sum_i rho_i, as the parts of a medium each emit sigma_a rho_i Q_i. A file without the
/// grid is dark; one at least must have it.
Channels glowOfAll(const std::vector<const VdbFile*>& files, const MediumSettings& words,
                   const Volume& density, const ReadSettings& reading) {
  const std::string& name = words.temperature ? *words.temperature : *words.emission;
  Channels total;
  for (const VdbFile* file : files) {
    if (!file->has(name)) continue;
    const Channels Q = glowOf(*file, words, density, reading);
    const Field<float> part = file->readOnto(file->densityName(words.density.value_or("")), density, reading);
    total.resize(Q.size());
    for (size_t c = 0; c < Q.size(); ++c) {
      if (total[c].empty()) total[c] = Field<float>(*density.topology);
      forEachBlock(part.blockCount(), [&](size_t b) {
        for (int n = 0; n < kBlockVoxels; ++n)
          if (const float rho = density.values.block(b)[n]; rho > 0)
            total[c].block(b)[n] += Q[c].block(b)[n] * (part.block(b)[n] / rho);
      });
    }
  }
  if (total.empty()) files.front()->require(name);
  return total;
}

}  // namespace

Medium readMedium(const std::vector<const VdbFile*>& files, const MediumSettings& words,
                  const ReadSettings& reading) {
  Medium medium;
  medium.optics = opticsOf(words);
  medium.density = densityOf(*files.front(), words, reading);
  for (size_t n = 1; n < files.size(); ++n) {
    const Volume more = densityOf(*files[n], words, reading);
    medium.density = naming(*files[n], more.name, [&] { return sum(std::move(medium.density), more); });
  }
  medium.density = cut(std::move(medium.density), cutOf(words));
  if (words.emission || words.temperature)
    medium.emission = files.size() == 1 ? glowOf(*files.front(), words, medium.density, reading)
                                        : glowOfAll(files, words, medium.density, reading);
  if (words.temperature) medium.optics.emission_scale = 1;  // which is of the other kind of grid
  return medium;
}

}  // namespace vdb_diffuse
