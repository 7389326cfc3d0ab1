#include "lit_volume.h"

#include <openvdb/openvdb.h>
#include <sys/stat.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <cmath>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

using openvdb::GridBase;

class LitFile {
 public:
  explicit LitFile(const std::string& path) : path_(path) {
    struct stat info;
    if (::stat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode))
      throw InputError(path + ": not a readable file; give the output of 'vdb_diffuse bake'");
    try {
      openvdb::initialize();
      openvdb::io::File file(path);
      file.open(/*delayLoad=*/false);
      for (auto name = file.beginName(); name != file.endName(); ++name)
        grids_.push_back(file.readGrid(*name));
    } catch (const std::exception& error) {
      throw InputError(path + ": not a readable VDB: " + error.what());
    }
  }

  const std::string& path() const { return path_; }
  GridBase::ConstPtr find(const std::string& name) const {
    for (const auto& grid : grids_)
      if (grid->getName() == name) return grid;
    return nullptr;
  }
  GridBase::ConstPtr need(const std::string& name, const std::string& cure) const {
    if (GridBase::ConstPtr grid = find(name)) return grid;
    std::string present;
    for (const auto& grid : grids_) present += " " + grid->getName();
    throw InputError(path_ + ": no grid '" + name + "'; there are:" + present + "; " + cure);
  }
  [[noreturn]] void refuse(const GridBase& grid, const std::string& why) const {
    throw InputError(path_ + ": grid '" + grid.getName() + "' " + why);
  }

 private:
  std::string path_;
  std::vector<GridBase::Ptr> grids_;
};

Transform transformOf(const LitFile& file, const GridBase& grid) {
  const openvdb::math::Transform& map = grid.transform();
  if (!map.isLinear()) file.refuse(grid, "has a frustum transform; resample it to a linear one");
  const Vec3d origin = map.indexToWorld(Vec3d(0));
  Vec3d axes[3];
  for (int a = 0; a < 3; ++a) {
    Vec3d step(0);
    step[a] = 1;
    axes[a] = map.indexToWorld(step) - origin;
    if (!axes[a].isFinite() || !(axes[a].length() > 0))
      file.refuse(grid, "has a transform that is not regular");
  }
  constexpr double kRight = 1e-6;  // cosine of the angle between axes that still counts as a right one
  for (int a = 0; a < 3; ++a)
    if (std::abs(axes[a].unit().dot(axes[(a + 1) % 3].unit())) > kRight)
      file.refuse(grid, "has a sheared transform; resample it to right angles");
  return Transform(axes[0], axes[1], axes[2], origin);
}

Volume densityOf(const LitFile& file, const GridBase& base) {
  const auto* source = dynamic_cast<const openvdb::FloatGrid*>(&base);
  if (!source) file.refuse(base, "is not a float grid; name the density with --density");
  if (base.getGridClass() == openvdb::GRID_LEVEL_SET)
    file.refuse(base, "is a level set; make a fog volume of it");
  constexpr openvdb::Index64 kMostVoxels = openvdb::Index64{1} << 31;  // 8 GB of density
  const openvdb::Index64 count = source->activeVoxelCount();
  if (count == 0) file.refuse(base, "has no active voxels: there is nothing to see");
  if (count > kMostVoxels)
    file.refuse(base, "has " + std::to_string(count) + " active voxels, too many to hold");

  const openvdb::FloatGrid::Ptr grid = source->deepCopy();
  grid->tree().voxelizeActiveTiles();
  std::vector<Coord> origins;
  std::vector<BlockMask> masks;
  for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
    origins.push_back(leaf->origin());
    masks.push_back(leaf->valueMask());
  }
  Volume volume;
  volume.name = base.getName();
  volume.topology = std::make_shared<Topology>(std::move(origins), std::move(masks));
  volume.transform = transformOf(file, base);
  volume.values = Field<float>(*volume.topology);
  for (size_t b = 0; b < volume.topology->blockCount(); ++b) {
    const auto* leaf = grid->tree().probeConstLeaf(volume.topology->origin(b));
    for (auto value = leaf->cbeginValueOn(); value; ++value) {
      if (!std::isfinite(*value) || *value < 0)
        file.refuse(base, "has a density that is not finite or negative; clean it up");
      volume.values.block(b)[value.pos()] = *value;
    }
  }
  return volume;
}

float component(float value, int) {
  return value;
}
float component(const openvdb::Vec3s& value, int c) {
  return value[c];
}

/// A grid's values at the density's active voxels.
template <typename Grid>
Channels sampled(const LitFile& file, const Grid& grid, const Volume& density, int channels) {
  const Transform transform = transformOf(file, grid);
  constexpr double kSame = 1e-6;  // voxels; a bake writes one transform into all its grids
  bool same = density.transform.toIndex(transform.origin()).length() < kSame;
  for (int a = 0; a < 3; ++a)
    same &=
        (transform.axis(a) - density.transform.axis(a)).length() < kSame * density.transform.axis(a).length();
  if (!same) file.refuse(grid, "has another transform than '" + density.name + "'; bake it again");

  const Topology& topology = *density.topology;
  Channels fields(channels, Field<float>(topology));
  std::atomic<size_t> bad{0};
  tbb::parallel_for(tbb::blocked_range<size_t>(0, topology.blockCount()), [&](const auto& range) {
    auto values = grid.getConstAccessor();
    for (size_t b = range.begin(); b != range.end(); ++b)
      for (auto n = topology.active(b).beginOn(); n; ++n) {
        const auto value = values.getValue(topology.origin(b) + voxelLocal(static_cast<int>(n.pos())));
        for (int c = 0; c < channels; ++c) {
          const float v = component(value, c);
          if (!std::isfinite(v)) ++bad;
          fields[c].block(b)[n.pos()] = v;
        }
      }
  });
  if (bad > 0)
    file.refuse(grid, "has " + std::to_string(bad) + " values that are NaN or infinite; bake it again");
  return fields;
}

Channels channelsOf(const LitFile& file, const GridBase& grid, const Volume& density) {
  if (const auto* grey = dynamic_cast<const openvdb::FloatGrid*>(&grid))
    return sampled(file, *grey, density, 1);
  if (const auto* rgb = dynamic_cast<const openvdb::Vec3SGrid*>(&grid))
    return sampled(file, *rgb, density, 3);
  file.refuse(grid, "is neither float nor vec3s");
}

/// A number that `bake` stored, if it did.
void fromMetadata(const GridBase& grid, const std::string& name, double& value) {
  if (const auto stored = grid.getMetadata<openvdb::DoubleMetadata>(name)) value = stored->value();
}

std::string textFromMetadata(const GridBase& grid, const std::string& name) {
  const auto stored = grid.getMetadata<openvdb::StringMetadata>(name);
  return stored ? stored->value() : "";
}

Optics opticsOf(const GridBase& lighting, const LitVolumeSettings& settings) {
  Optics optics;
  const char* suffix[] = {"_r", "_g", "_b"};
  for (int c = 0; c < 3; ++c) {
    fromMetadata(lighting, std::string("sigma_s") + suffix[c], optics.sigma_s[c]);
    fromMetadata(lighting, std::string("sigma_a") + suffix[c], optics.sigma_a[c]);
  }
  fromMetadata(lighting, "g", optics.g);
  fromMetadata(lighting, "emission_scale", optics.emission_scale);
  optics.sigma_s = settings.sigma_s.value_or(optics.sigma_s);
  optics.sigma_a = settings.sigma_a.value_or(optics.sigma_a);
  optics.g = settings.g.value_or(optics.g);
  optics.emission_scale = settings.emission_scale.value_or(optics.emission_scale);
  return optics;
}

void checkOptics(const std::string& path, const Optics& optics) {
  bool good = std::abs(optics.g) < 1 && std::isfinite(optics.emission_scale) && optics.emission_scale >= 0;
  for (int c = 0; c < 3; ++c)
    for (const double sigma : {optics.sigma_s[c], optics.sigma_a[c]})
      good &= std::isfinite(sigma) && sigma >= 0;
  if (!good)
    throw InputError(path + ": the stored medium is out of range; give --sigma-s, --sigma-a and --g");
}

}  // namespace

LitVolume readLitVolume(const std::string& path, const LitVolumeSettings& settings,
                        std::vector<std::string>& warnings) {
  const LitFile file(path);
  const std::string cure = "bake it with --grids density,diffuse,direct, or choose others with --light";
  const GridBase::ConstPtr diffuse = settings.diffuse ? file.need("diffuse", cure) : nullptr;
  const GridBase::ConstPtr direct = settings.direct ? file.need("direct", cure) : nullptr;
  const GridBase& lighting = diffuse ? *diffuse : *direct;

  LitVolume lit;
  Medium& medium = lit.medium;
  medium.optics = opticsOf(lighting, settings);
  checkOptics(path, medium.optics);
  std::string name = settings.density.empty() ? textFromMetadata(lighting, "density") : settings.density;
  if (name.empty()) name = "density";
  medium.density = densityOf(file, *file.need(name, "name the density with --density"));
  if (diffuse) lit.diffuse = channelsOf(file, *diffuse, medium.density);
  if (direct) lit.direct = channelsOf(file, *direct, medium.density);

  const std::string stored = textFromMetadata(lighting, "emission");
  const std::string emission = settings.emission.empty() ? stored : settings.emission;
  if (!settings.emission.empty()) file.need(emission, "name the emission with --emission");
  if (const GridBase::ConstPtr grid = emission.empty() ? nullptr : file.find(emission)) {
    Channels channels = channelsOf(file, *grid, medium.density);
    if (channels.size() != 1) file.refuse(*grid, "is coloured; the emission is a float grid");
    medium.emission = std::move(channels[0]);
  } else if (!emission.empty()) {
    warnings.push_back(path + ": no grid '" + emission +
                       "': the volume's own glow is not shown; bake with --keep " + emission);
  }
  if (medium.optics.g != 0 && diffuse) {
    if (const GridBase::ConstPtr grid = file.find("flux")) {
      Channels channels = channelsOf(file, *grid, medium.density);
      if (channels.size() != 3) file.refuse(*grid, "is not a vec3s grid; bake it again");
      for (int a = 0; a < 3; ++a) lit.flux[a] = std::move(channels[a]);
    } else {
      warnings.push_back(path +
                         ": no grid 'flux': scattering looks isotropic though g is not 0; bake with --grids "
                         "density,diffuse,direct,flux");
    }
  }
  return lit;
}

}  // namespace vdb_diffuse
