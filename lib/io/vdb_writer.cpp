#include "io/vdb_writer.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "grid/error.h"
#include "io/atomic_file.h"
#include "io/vdb_dilate.h"
#include "vdb/header.h"

namespace vdb_diffuse {
namespace {

constexpr float kLargestHalf = 65504;
constexpr char kProgram[] = "vdb_diffuse " VDB_DIFFUSE_VERSION;

void setMetadata(openvdb::MetaMap& map, const Metadata& metadata) {
  for (const auto& [name, value] : metadata) {
    map.removeMeta(name);  // a value of another type could not take its place
    if (const auto* text = std::get_if<std::string>(&value))
      map.insertMeta(name, openvdb::StringMetadata(*text));
    else if (const double* number = std::get_if<double>(&value))
      map.insertMeta(name, openvdb::DoubleMetadata(*number));
    else
      map.insertMeta(name, openvdb::Int32Metadata(std::get<int>(value)));
  }
}

float largestMagnitude(const Channels& channels) {
  struct Largest {
    float value = 0;
    Largest& operator+=(const Largest& o) {
      value = std::max(value, o.value);
      return *this;
    }
  };
  Largest largest;
  for (const Field<float>& field : channels)
    largest += sumOverBlocks<Largest>(field.blockCount(), [&](size_t b) {
      Largest of_block;
      for (int n = 0; n < kBlockVoxels; ++n)
        of_block.value = std::max(of_block.value, std::abs(field.block(b)[n]));
      return of_block;
    });
  return largest.value;
}

/// The topologies of 0, 1, .. `layers` voxels of widening; the first is not owned.
std::vector<std::shared_ptr<const Topology>> widened(const std::shared_ptr<const Topology>& topology,
                                                     int layers) {
  std::vector<std::shared_ptr<const Topology>> result{topology};
  for (int n = 0; n < layers; ++n)
    result.push_back(std::make_shared<Topology>(dilatedTopology(*result.back())));
  return result;
}

/// Grids of the source to pass through, in the order in which it lists them.
std::vector<std::string> keptNames(const VdbFile* source, const std::vector<std::string>& keep,
                                   const std::set<std::string>& written) {
  if (keep.empty()) return {};
  if (!source) throw UsageError("grids are to be kept, but there is no file to take them from");
  const bool all = std::find(keep.begin(), keep.end(), "all") != keep.end() && !source->has("all");
  for (const std::string& name : keep) {
    if (name == "all" && all) continue;
    source->require(name);
    if (written.count(name)) throw UsageError("grid " + name + " is written anew and cannot be kept as well");
  }
  std::vector<std::string> names;
  for (const GridSummary& grid : source->grids()) {
    const bool named = std::find(keep.begin(), keep.end(), grid.name) != keep.end();
    if (named || (all && !written.count(grid.name))) names.push_back(grid.name);
  }
  return names;
}

/// io::File and not io::Stream writes, as only it stores where each grid lies, which readers need to pick
/// one. It keeps silent about a full disk, so the file's frame is read again: every grid, up to the last
/// byte.
void writeAndVerify(const std::string& path, const openvdb::GridCPtrVec& grids,
                    const openvdb::MetaMap& metadata, WriteReport& report) {
  AtomicFile file(path);
  try {
    openvdb::io::File(file.temporary()).write(grids, metadata);
  } catch (const openvdb::Exception& error) {
    throw OutputError(path + ": cannot be written: " + error.what());
  }
  bool whole = false;
  try {
    const VdbHeader header = readVdbHeader(file.temporary());
    whole = header.grids.size() == grids.size() &&
            (grids.empty() || header.grids.back().end_position == header.bytes);
    for (size_t g = 0; whole && g < grids.size(); ++g) {
      const std::string& name = header.grids[g].name;
      whole = name.compare(0, grids[g]->getName().size(), grids[g]->getName()) == 0;
    }
    report.bytes = header.bytes;
  } catch (const InputError&) {
    whole = false;
  }
  if (!whole)
    throw OutputError(path + ": was not written whole; is the disk full? What was there is untouched");
  file.commit();
}

}  // namespace

WriteReport writeVdb(const std::string& path, const Volume& where, std::vector<OutputGrid> grids,
                     const WriteSettings& settings, const VdbFile* source,
                     const std::vector<std::string>& keep) {
  openvdb::initialize();
  if (source && sameFile(path, source->path()))
    throw UsageError(path + ": is the input as well; name another output");
  if (settings.dilate < 0 || settings.dilate > 32)
    throw UsageError("the output can be widened by 0 to 32 voxels, not " + std::to_string(settings.dilate));
  std::set<std::string> written;
  for (const OutputGrid& grid : grids)
    if (!written.insert(grid.name).second) throw UsageError("two grids would be called " + grid.name);

  WriteReport report;
  openvdb::GridCPtrVec output;
  for (const std::string& name : keptNames(source, keep, written)) output.push_back(source->readGrid(name));
  openvdb::MetaMap metadata;
  if (source)
    for (const auto& [name, value] : source->metadata())
      metadata.insertMeta(name, openvdb::StringMetadata(value));
  metadata.insertMeta("creator", openvdb::StringMetadata(kProgram));
  setMetadata(metadata, settings.metadata);

  openvdb::math::Transform::Ptr transform = openvdbTransform(where.transform);
  if (source && source->has(where.name)) {  // the source's own where it is: the same to the last bit
    const auto grid = source->readGrid(where.name);
    if (sameVoxels(transformOf(*grid), where.transform, *where.topology))
      transform = grid->constTransform().copy();
  }

  const auto topologies = widened(where.topology, settings.dilate);
  for (OutputGrid& grid : grids) {
    const int layers = grid.as_is ? 0 : settings.dilate;
    for (Field<float>& field : grid.channels)
      for (int n = 0; n < layers; ++n) field = dilatedField(*topologies[n], field, *topologies[n + 1]);
    const openvdb::GridBase::Ptr tree = gridOf(*topologies[layers], grid.channels, Transform());
    tree->setTransform(transform->copy());
    tree->setName(grid.name);
    tree->setGridClass(grid.channels.size() == 1 ? openvdb::GRID_FOG_VOLUME : openvdb::GRID_UNKNOWN);
    setMetadata(*tree, grid.metadata);
    if (!grid.unit.empty()) tree->insertMeta("unit", openvdb::StringMetadata(grid.unit));
    tree->insertMeta("program", openvdb::StringMetadata(kProgram));
    if (settings.half && !grid.as_is) {
      if (largestMagnitude(grid.channels) <= kLargestHalf)
        tree->setSaveFloatAsHalf(true);
      else
        report.warnings.push_back("grid " + grid.name + " has values above 65504 and is stored in 32 bits");
    }
    grid.channels.clear();
    output.push_back(tree);
  }
  writeAndVerify(path, output, metadata, report);
  return report;
}

void writeVolume(const std::string& path, const Volume& volume,
                 const std::map<std::string, std::string>& metadata) {
  WriteSettings settings;
  settings.metadata.insert(metadata.begin(), metadata.end());
  std::vector<OutputGrid> grids(1);
  grids[0].name = volume.name;
  grids[0].channels.push_back(volume.values);
  writeVdb(path, volume, std::move(grids), settings);
}

}  // namespace vdb_diffuse
