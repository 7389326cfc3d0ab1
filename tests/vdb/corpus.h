#pragma once

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <fstream>
#include <functional>
#include <string>
#include <vector>

namespace vdb_diffuse {

/// Sound VDB files, small ones, that between them use every part of the format: each value type,
/// compression and way of storing inactive values, tiles of every width, transforms, instances, grids with
/// nothing in them, points, and a file written as a stream. All but `points` have a density to bake.
struct VdbSpecimen {
  std::string name;
  std::function<void(const std::string& path)> write;
};

namespace corpus {

using openvdb::Coord;

/// A box of 11^3 voxels across 8 leaves of one node, with values that a compressor has work with.
template <typename Grid>
typename Grid::Ptr box(const std::string& name, double scale = 1) {
  using Value = typename Grid::ValueType;
  auto grid = Grid::create();
  grid->setName(name);
  auto accessor = grid->getAccessor();
  for (int x = -13; x <= -3; ++x)
    for (int y = -13; y <= -3; ++y)
      for (int z = -13; z <= -3; ++z) {
        const double value = scale * (1 + (x * x + 3 * y * y + 5 * z * z) % 7);
        if constexpr (openvdb::VecTraits<Value>::IsVec) {
          using Element = typename openvdb::VecTraits<Value>::ElementType;
          accessor.setValueOn(Coord(x, y, z), Value(Element(value), Element(2 * value), Element(3 * value)));
        } else {
          accessor.setValueOn(Coord(x, y, z), static_cast<Value>(value));
        }
      }
  return grid;
}

inline openvdb::FloatGrid::Ptr fog(const std::string& name = "density") {
  auto grid = box<openvdb::FloatGrid>(name, 0.05);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
  return grid;
}

inline void write(const std::string& path, const openvdb::GridPtrVec& grids,
                  uint32_t compression = openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK) {
  openvdb::io::File file(path);
  file.setCompression(compression);
  openvdb::MetaMap metadata;
  metadata.insertMeta("creator", openvdb::StringMetadata("somebody"));
  metadata.insertMeta("frame", openvdb::Int32Metadata(7));
  metadata.insertMeta("weight", openvdb::DoubleMetadata(0.5));
  metadata.insertMeta("at", openvdb::Vec3SMetadata(openvdb::Vec3s(1, 2, 3)));
  file.write(grids, metadata);
}

/// Inactive values of one, two and many kinds, beside the background, in three leaves.
inline openvdb::FloatGrid::Ptr inactiveValues(const std::string& name) {
  auto grid = openvdb::FloatGrid::create(0.5f);
  grid->setName(name);
  for (int leaf = 0; leaf < 6; ++leaf) {
    const Coord corner(8 * leaf, 0, 0);
    grid->tree().setValueOn(corner, 0.25f);
    for (int n = 1; n < 512 && leaf > 0; ++n) {
      const Coord p = corner.offsetBy(n / 64, n / 8 % 8, n % 8);
      const float kinds[6][3] = {{}, {2, 2, 2}, {-0.5f, 0.5f, -0.5f}, {3, 0.5f, 3}, {3, 0.25f, 3}, {1, 2, 3}};
      grid->tree().setValueOff(p, kinds[leaf][n % 3]);
    }
  }
  return grid;
}

inline openvdb::GridBase::Ptr points() {
  openvdb::initialize();
  std::vector<openvdb::Vec3f> positions;
  for (int n = 0; n < 20; ++n)
    positions.emplace_back(0.7f * float(n % 5), 0.9f * float(n / 5), 0.1f * float(n));
  const auto transform = openvdb::math::Transform::createLinearTransform(0.5);
  auto grid =
      openvdb::points::createPointDataGrid<openvdb::points::NullCodec, openvdb::points::PointDataGrid>(
          positions, *transform);
  grid->setName("drops");
  return grid;
}

inline openvdb::GridPtrVec everyType() {
  auto empty = openvdb::FloatGrid::create(2.f);
  empty->setName("empty");
  auto mask = openvdb::MaskGrid::create();
  mask->setName("mask");
  mask->denseFill(openvdb::CoordBBox(Coord(-2), Coord(9)), true, true);
  auto wet = openvdb::BoolGrid::create();
  wet->setName("wet");
  wet->denseFill(openvdb::CoordBBox(Coord(-2), Coord(9)), true, true);
  auto density = fog();
  density->insertMeta("artist", openvdb::StringMetadata("somebody"));
  auto instance = density->copyGrid();  // shares the tree
  instance->setName("shared");
  return {density,
          instance,
          empty,
          mask,
          wet,
          box<openvdb::DoubleGrid>("double", 0.1),
          box<openvdb::Int32Grid>("int32"),
          box<openvdb::Int64Grid>("int64"),
          box<openvdb::Vec3SGrid>("vec3s"),
          box<openvdb::Vec3DGrid>("vec3d"),
          box<openvdb::Vec3IGrid>("vec3i"),
          fog("twice"),
          fog("twice")};
}

}  // namespace corpus

inline std::vector<VdbSpecimen> vdbCorpus() {
  using namespace corpus;
  using openvdb::GridPtrVec;
  constexpr uint32_t kZip = openvdb::io::COMPRESS_ZIP, kMask = openvdb::io::COMPRESS_ACTIVE_MASK,
                     kBlosc = openvdb::io::COMPRESS_BLOSC;
  openvdb::initialize();
  std::vector<VdbSpecimen> specimens;
  const auto add = [&](const std::string& name, const std::function<void(const std::string&)>& write) {
    specimens.push_back({name, write});
  };
  add("blosc", [](const std::string& path) { write(path, {fog()}); });
  add("plain", [](const std::string& path) { write(path, {fog()}, 0); });
  add("active", [](const std::string& path) { write(path, {fog()}, kMask); });
  add("zip", [](const std::string& path) {
    auto grid = fog();
    grid->setGridClass(openvdb::GRID_UNKNOWN);  // others are not packed by zip
    write(path, {grid}, kZip | kMask);
  });
  add("blosc_all", [](const std::string& path) { write(path, {fog()}, kBlosc); });
  add("half", [](const std::string& path) {
    auto grid = fog();
    auto velocity = box<openvdb::Vec3SGrid>("velocity");
    grid->setSaveFloatAsHalf(true);
    velocity->setSaveFloatAsHalf(true);
    write(path, {grid, velocity});
  });
  add("double", [](const std::string& path) {
    auto twice = box<openvdb::DoubleGrid>("density", 0.02);
    twice->setTransform(openvdb::math::Transform::createLinearTransform(
        openvdb::Mat4d(0., 0.5, 0., 0., -0.5, 0., 0., 0., 0., 0., 0.25, 0., 1., 2., 3., 1.)));
    write(path, {twice}, kZip);
  });
  add("vec3s", [](const std::string& path) {
    write(path, {fog(), box<openvdb::Vec3SGrid>("v")}, kZip | kMask);
  });
  add("tiles", [](const std::string& path) {
    auto grid = fog();
    grid->tree().addTile(1, Coord(8, 8, 8), 0.125f, true);
    grid->tree().addTile(1, Coord(16, 8, 8), 0.5f, false);
    auto giant = fog("giant");
    giant->tree().addTile(2, Coord(128, 0, 0), 0.5f, true);
    giant->tree().addTile(3, Coord(4096, 0, 0), 0.5f, true);
    giant->tree().addTile(3, Coord(-8192, 0, 4096), 0.25f, false);
    write(path, {grid, giant});
  });
  add("inactive", [](const std::string& path) { write(path, {fog(), inactiveValues("inactive")}); });
  add("inactive_zip", [](const std::string& path) {
    auto half = inactiveValues("half");
    half->setSaveFloatAsHalf(true);
    write(path, {fog(), inactiveValues("inactive"), half}, kZip | kMask);
  });
  add("level_set", [](const std::string& path) {
    auto ball = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(2, openvdb::Vec3f(0), 0.5f);
    ball->setName("ball");
    write(path, {fog(), ball});
  });
  add("frustum", [](const std::string& path) {
    auto grid = fog("camera");
    grid->setTransform(openvdb::math::Transform::createFrustumTransform(
        openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(10)), 0.5, 4, 0.2));
    write(path, {fog(), grid});
  });
  add("every_type", [](const std::string& path) { write(path, everyType()); });
  add("every_type_zip", [](const std::string& path) { write(path, everyType(), kZip | kMask); });
  add("points", [](const std::string& path) { write(path, {fog(), points()}); });
  add("stream", [](const std::string& path) {
    std::ofstream out(path, std::ios::binary);
    openvdb::io::Stream(out).write(everyType());
  });
  add("stream_plain", [](const std::string& path) {
    std::ofstream out(path, std::ios::binary);
    openvdb::io::Stream stream(out);
    stream.setCompression(0);
    stream.write(GridPtrVec{fog()});
  });
  return specimens;
}

}  // namespace vdb_diffuse
