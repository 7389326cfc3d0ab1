#include "stored_truth.h"

#include <openvdb/Grid.h>

#include <cmath>
#include <cstdlib>
#include <sstream>

#include "grid/error.h"
#include "io/vdb_reader.h"

namespace vdb_diffuse {
namespace {

/// Numbers that a grid's metadata may hold, of the medium it was made for.
void checkOptics(const std::string& path, const openvdb::MetaMap& metadata, const Medium& medium) {
  const Optics& optics = medium.optics;
  const auto check = [&](const std::string& name, double here) {
    const auto item = metadata.getMetadata<openvdb::DoubleMetadata>(name);
    if (!item || std::abs(item->value() - here) <= 1e-6 * std::max(std::abs(here), std::abs(item->value())))
      return;
    std::ostringstream line;
    line << path << ": was made with " << name << " " << item->value() << ", and here it is " << here
         << "; give the flags that it was made with";
    throw InputError(line.str());
  };
  const char* suffix[] = {"_r", "_g", "_b"};
  for (int c = 0; c < 3; ++c) {
    check(std::string("sigma_s") + suffix[c], optics.sigma_s[c]);
    check(std::string("sigma_a") + suffix[c], optics.sigma_a[c]);
  }
  check("g", optics.g);
  const bool had_albedo = metadata["albedo_grid"] != nullptr;
  if (metadata["generator"] && had_albedo == medium.albedo.empty())
    throw InputError(path + ": was made with" + (had_albedo ? " an albedo grid" : "out an albedo grid") +
                     "; give the flags that it was made with");
}

bool sameTopology(const Topology& a, const Topology& b) {
  if (a.blockCount() != b.blockCount() || a.activeVoxelCount() != b.activeVoxelCount()) return false;
  for (size_t i = 0; i < a.blockCount(); ++i)  // blocks stand in an order that the coordinates alone give
    if (a.origin(i) != b.origin(i) || !(a.active(i) == b.active(i))) return false;
  return true;
}

}  // namespace

Truth readTruth(const std::string& path, const Medium& medium, std::vector<std::string>& warnings) {
  const VdbFile file(path);
  file.require("diffuse", "make one with: vdb_diffuse reference");
  Truth truth;
  truth.diffuse = file.readValues("diffuse");
  truth.noisy = file.has("diffuse_se");
  if (truth.noisy)
    truth.standard_error = file.readValues("diffuse_se");
  else
    warnings.push_back(
        path + ": has no grid diffuse_se: its noise is not known, and counts as error of the methods");
  if (!sameTopology(*truth.diffuse.topology, medium.topology()) ||
      !sameVoxels(truth.diffuse.transform, medium.transform(), medium.topology()))
    throw InputError(path +
                     ": grid diffuse: its voxels are not those of the density; make it for this volume, "
                     "without --dilate");
  const auto grid = file.readGrid("diffuse");
  checkOptics(path, *grid, medium);
  if (file.has("direct")) truth.direct = file.readValues("direct");
  if (const auto seed = grid->getMetadata<openvdb::StringMetadata>("seed"))
    truth.seed = std::strtoull(seed->value().c_str(), nullptr, 10);
  return truth;
}

}  // namespace vdb_diffuse
