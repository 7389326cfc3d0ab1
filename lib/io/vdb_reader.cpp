#include "io/vdb_reader.h"

#include <openvdb/openvdb.h>
#include <sys/stat.h>

#include <cmath>
#include <map>
#include <mutex>

#include "grid/error.h"
#include "grid/spelling.h"
#include "io/free_memory.h"
#include "vdb/structure.h"

namespace vdb_diffuse {
namespace {

constexpr float kLargestValue = 1e30f;  // its products with sigma and voxel size stay within a float

bool isScalar(const GridSummary& grid) {
  return grid.value_type == "float" || grid.value_type == "double";
}
bool isFog(const GridSummary& grid) {
  return isScalar(grid) && (grid.grid_class == "fog volume" || grid.grid_class == "unknown");
}

GridSummary summaryOf(const openvdb::GridBase& grid) {
  GridSummary summary;
  summary.value_type = grid.valueType();
  summary.grid_class = openvdb::GridBase::gridClassToString(grid.getGridClass());
  if (grid.type().find("ptdata") != std::string::npos) summary.value_type = summary.grid_class = "points";
  summary.half = grid.saveFloatAsHalf();
  return summary;
}

std::string at(const Coord& p) {
  return "(" + std::to_string(p[0]) + "," + std::to_string(p[1]) + "," + std::to_string(p[2]) + ")";
}

struct BadValues {
  uint64_t count = 0, too_large = 0;
  Coord first{0, 0, 0};
  float value = 0;
  bool any() const { return count + too_large > 0; }
  BadValues& operator+=(const BadValues& o) {
    if (!any() && o.any()) {
      first = o.first;
      value = o.value;
    }
    count += o.count;
    too_large += o.too_large;
    return *this;
  }
};

enum class Sign { kNotNegative, kAny };

/// Holds the active values, called `what`, to kLargestValue: refuses, or with `clamp` repairs, what is not
/// finite or has a sign it must not have; what is larger is refused always, as no value in its place would be
/// right.
void requireRange(const std::string& name, const std::string& what, const Topology& topology,
                  Field<float>& values, Sign sign, bool clamp) {
  const float lowest = sign == Sign::kAny ? -kLargestValue : 0;
  const BadValues bad = sumOverBlocks<BadValues>(topology.blockCount(), [&](size_t b) {
    BadValues s;
    float* value = values.block(b);
    for (auto voxel = topology.active(b).beginOn(); voxel; ++voxel) {
      float& v = value[voxel.pos()];
      if (v >= lowest && v <= kLargestValue) continue;
      const bool large = std::isfinite(v) && (v > 0 || sign == Sign::kAny);
      if (clamp && !large) {
        v = 0;
        continue;
      }
      if (!s.any()) {
        s.first = topology.origin(b) + voxelLocal(voxel.pos());
        s.value = v;
      }
      ++(large ? s.too_large : s.count);
    }
    return s;
  });
  if (!bad.any()) return;
  char value[40];
  std::snprintf(value, sizeof value, "%g", bad.value);
  const uint64_t count = bad.count + bad.too_large;
  const std::string range = sign == Sign::kAny ? "-1e30..1e30" : "0..1e30";
  throw InputError("grid " + name + ": " + what + " " + value + " at " + at(bad.first) + " is outside " +
                   range +
                   (count > 1 ? ", the first of " + std::to_string(count) + " active values that are" : "") +
                   (bad.too_large ? "; rescale the grid" : "; mend the grid, or set it to 0 by --clamp"));
}

/// Clamps the active values to 0..1; how many voxels with a value of `where` above zero that changed.
uint64_t clampToUnit(const Volume& where, Channels& channels) {
  return sumOverBlocks<uint64_t>(where.topology->blockCount(), [&](size_t b) {
    uint64_t count = 0;
    for (auto voxel = where.topology->active(b).beginOn(); voxel; ++voxel) {
      bool changed = false;
      for (Field<float>& values : channels) {
        float& v = values.block(b)[voxel.pos()];
        changed = changed || !(v >= 0 && v <= 1);
        v = std::clamp(v, 0.0f, 1.0f);
      }
      count += changed && where.values.block(b)[voxel.pos()] > 0;
    }
    return count;
  });
}

/// Refuses a tree that would not fit before OpenVDB makes its nodes. In a damaged file, or one made to do
/// harm, nodes are many times larger in memory than on the disk.
void requireMemory(const std::string& start, uint64_t tree_bytes) {
  const uint64_t free = freeMemory();
  if (tree_bytes <= free) return;
  char text[120];
  std::snprintf(text, sizeof text,
                "its nodes would take %.4g MB, with %.4g MB to spare; use a coarser volume",
                static_cast<double>(tree_bytes) / 1e6, static_cast<double>(free) / 1e6);
  throw InputError(start + text);
}

/// What changes where a file is written to.
struct FileState {
  dev_t device = 0;
  ino_t inode = 0;
  off_t size = 0;
  timespec written{};

  explicit FileState(const std::string& path) {
    struct stat info;
    if (stat(path.c_str(), &info) != 0) return;  // gone: no file at all
    device = info.st_dev;
    inode = info.st_ino;
    size = info.st_size;
    written = info.st_mtim;
  }
  bool sameFile(const FileState& o) const { return device == o.device && inode == o.inode; }
  bool unchanged(const FileState& o) const {
    return size == o.size && written.tv_sec == o.written.tv_sec && written.tv_nsec == o.written.tv_nsec;
  }
};

}  // namespace

struct VdbFile::Impl {
  std::string path;
  FileState opened;
  VdbHeader header;
  std::unique_ptr<openvdb::io::File> file;
  std::vector<GridSummary> grids;
  std::map<std::string, openvdb::GridBase::Ptr> read;
  std::mutex mutex;  // a File has one position for reading

  explicit Impl(const std::string& file_path) : path(file_path), opened(file_path) {}

  /// The bytes that were checked are those that OpenVDB is given.
  void requireUnchanged() const {
    const FileState now(path);
    if (now.sameFile(opened) && !now.unchanged(opened))
      throw InputError(path + ": was changed while it was being read; run again once it is whole");
  }

  /// Runs work on the file and turns whatever it throws into an InputError that names the file.
  template <typename Work>
  auto guarded(const Work& work) const -> decltype(work()) {
    try {
      return work();
    } catch (const InputError& error) {
      const std::string what = error.what();
      throw what.compare(0, path.size(), path) == 0 ? error : InputError(path + ": " + what);
    } catch (const Error&) {
      throw;
    } catch (const std::bad_alloc&) {
      requireUnchanged();  // else bytes that nobody has checked may have asked for the memory
      throw;
    } catch (const std::exception& error) {
      throw InputError(path + ": cannot be read: " + error.what());
    }
  }

  const GridSummary& find(const std::string& name) const {
    for (const GridSummary& grid : grids)
      if (grid.name == name) return grid;
    std::vector<std::string> names;
    for (const GridSummary& grid : grids) names.push_back(grid.name);
    const std::string nearest = nearestSpelling(name, names);
    throw InputError("no grid " + name + (nearest.empty() ? "" : "; did you mean " + nearest + "?") +
                     (names.empty() ? "; it has no grids" : "; it has " + commaList(names)));
  }

  /// Says why a grid cannot be a density, if it cannot.
  void requireFog(const GridSummary& grid, const std::string& use) const {
    const std::string start = "grid " + grid.name + ": ";
    if (grid.value_type == "points")
      throw InputError(start + "holds points; " + use + " is a float fog volume: rasterise the points first");
    if (grid.grid_class == "level set")
      throw InputError(start + "is a level set; " + use +
                       " is a fog volume: convert it first (sdfToFogVolume)");
    if (!isScalar(grid))
      throw InputError(start + "holds " + grid.value_type + "; " + use + " is a float grid");
  }
};

VdbFile::VdbFile(const std::string& path) : impl_(std::make_unique<Impl>(path)) {
  impl_->header = checkVdb(path);
  openvdb::initialize();
  impl_->guarded([&] {
    uint64_t all_bytes = 0;
    for (const VdbHeader::Grid& grid : impl_->header.grids)
      if (grid.instance_of.empty()) all_bytes += grid.tree_bytes;
    if (!impl_->header.has_offsets) requireMemory("", all_bytes);  // opening such a file reads all of it
    impl_->file = std::make_unique<openvdb::io::File>(path);
    impl_->file->open(false);  // without delayed loading, which trusts sizes kept in the metadata
    for (auto name = impl_->file->beginName(); name != impl_->file->endName(); ++name) {
      const openvdb::GridBase::Ptr grid = impl_->file->readGridMetadata(name.gridName());
      GridSummary summary = summaryOf(*grid);
      summary.name = name.gridName();
      for (const VdbHeader::Grid& stored : impl_->header.grids) {
        if (stored.name == summary.name) summary.compression = compressionName(stored.compression);
        // By type and not by name, as OpenVDB finds grids by names of more than one spelling.
        if (stored.tree_type == grid->type() && !stored.checked) summary.readable = false;
      }
      impl_->grids.push_back(summary);
    }
    if (impl_->grids.size() != impl_->header.grids.size())
      throw InputError(std::to_string(impl_->header.grids.size()) + " grids are stored and OpenVDB finds " +
                       std::to_string(impl_->grids.size()) + "; write the file again");
  });
}

VdbFile::~VdbFile() = default;
VdbFile::VdbFile(VdbFile&&) noexcept = default;
VdbFile& VdbFile::operator=(VdbFile&&) noexcept = default;

const std::string& VdbFile::path() const {
  return impl_->path;
}
const std::vector<GridSummary>& VdbFile::grids() const {
  return impl_->grids;
}

bool VdbFile::has(const std::string& name) const {
  for (const GridSummary& grid : impl_->grids)
    if (grid.name == name) return true;
  return false;
}

void VdbFile::require(const std::string& name, const std::string& cure) const {
  impl_->guarded([&] {
    try {
      impl_->find(name);
    } catch (const InputError& error) {
      throw InputError(error.what() + (cure.empty() ? "" : "; " + cure));
    }
  });
}

std::string VdbFile::densityName(const std::string& name) const {
  return impl_->guarded([&]() -> std::string {
    if (!name.empty()) return impl_->find(name).name;
    if (has("density")) return "density";
    std::vector<std::string> all, fogs;
    for (const GridSummary& grid : impl_->grids) {
      all.push_back(grid.name + " (" + (grid.grid_class == "unknown" ? "" : grid.grid_class + ", ") +
                    grid.value_type + ")");
      if (isFog(grid)) fogs.push_back(grid.name);
    }
    if (fogs.size() == 1) return fogs[0];
    if (fogs.size() > 1)
      throw InputError("no grid density, and several that could be: " + commaList(fogs) +
                       "; choose by --density");
    // A single grid of another kind gets its own, more telling refusal.
    if (all.size() == 1) return impl_->grids[0].name;
    throw InputError("no grid density and no other float fog volume; it has " +
                     (all.empty() ? "no grids" : commaList(all)));
  });
}

Volume VdbFile::readDensity(const std::string& name, const ReadSettings& settings) const {
  const std::string chosen = densityName(name);
  return impl_->guarded([&] {
    impl_->requireFog(impl_->find(chosen), "a density");
    GridValues values = readValues(chosen, settings);
    requireRange(chosen, "density", *values.topology, values.channels[0], Sign::kNotNegative, settings.clamp);
    return Volume{chosen, values.topology, values.transform, std::move(values.channels[0])};
  });
}

GridValues VdbFile::readValues(const std::string& name, const ReadSettings& settings) const {
  return impl_->guarded([&] {
    const auto grid = readGrid(name);
    return valuesOf(*grid, settings.max_bytes ? settings.max_bytes : freeMemory());
  });
}

Field<float> VdbFile::readOnto(const std::string& name, const Volume& target,
                               const ReadSettings& settings) const {
  return impl_->guarded([&] {
    impl_->requireFog(impl_->find(name), "what is wanted");
    Field<float> values = sampleOnto(*readGrid(name), target);
    requireRange(name, "value", *target.topology, values, Sign::kNotNegative, settings.clamp);
    return values;
  });
}

Channels VdbFile::readChannelsOnto(const std::string& name, const Volume& target,
                                   const ReadSettings& settings) const {
  return impl_->guarded([&] {
    Channels channels = interpolateOnto(*readGrid(name), target);
    for (Field<float>& values : channels)
      requireRange(name, "value", *target.topology, values, Sign::kAny, settings.clamp);
    return channels;
  });
}

VdbFile::Factors VdbFile::readFactorsOnto(const std::string& name, const Volume& target,
                                          const ReadSettings& settings) const {
  return impl_->guarded([&] {
    if (impl_->find(name).grid_class == "level set")
      throw InputError("grid " + name + ": is a level set; what is wanted are colours, or numbers in 0..1");
    FilledValues filled = fillOnto(*readGrid(name), target);
    for (Field<float>& values : filled.channels)
      requireRange(name, "value", *target.topology, values, Sign::kAny, settings.clamp);
    Factors factors;
    factors.clamped = clampToUnit(target, filled.channels);
    factors.channels = std::move(filled.channels);
    factors.background = filled.background;
    factors.outside = filled.outside;
    return factors;
  });
}

Census VdbFile::readCensus(const std::string& name) const {
  return impl_->guarded([&] { return census(*readGrid(name)); });
}

std::shared_ptr<const openvdb::GridBase> VdbFile::readGrid(const std::string& name) const {
  return impl_->guarded([&]() -> std::shared_ptr<const openvdb::GridBase> {
    const GridSummary& summary = impl_->find(name);
    if (!summary.readable)
      throw InputError("grid " + name + ": holds " + summary.value_type +
                       ", which are not read; leave the grid out");
    const std::lock_guard<std::mutex> lock(impl_->mutex);
    openvdb::GridBase::Ptr& grid = impl_->read[name];
    if (!grid) {
      for (const VdbHeader::Grid& stored : impl_->header.grids)
        if (stored.name == name && impl_->header.has_offsets)
          requireMemory("grid " + name + ": ", stored.tree_bytes);
      impl_->requireUnchanged();
      grid = impl_->file->readGrid(name);
    }
    return grid;
  });
}

void VdbFile::forget(const std::string& name) const {
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  if (impl_->header.has_offsets) impl_->read.erase(name);
}

std::vector<std::pair<std::string, std::string>> VdbFile::metadata() const {
  std::vector<std::pair<std::string, std::string>> result;
  const openvdb::MetaMap::Ptr metadata = impl_->file->getMetadata();
  for (auto item = metadata->beginMeta(); item != metadata->endMeta(); ++item)
    result.emplace_back(item->first, item->second->str());
  return result;
}

}  // namespace vdb_diffuse
