#include "vdb/structure.h"

#include <gtest/gtest.h>

#include "io/expect_error.h"
#include "io/temporary_folder.h"
#include "io/vdb_reader.h"
#include "vdb/corpus.h"

namespace vdb_diffuse {
namespace {

/// Where things lie in the specimens with one grid, a box in one node of each level: backwards from where the
/// values begin.
constexpr uint64_t kLeafMask = 64, kLeafMasks = 8 * kLeafMask, kLowerMasks = 2 * 4096 / 8,
                   kUpperMasks = 2 * 32768 / 8, kCorner = 12;

class VdbStructure : public ::testing::Test {
 protected:
  /// Writes a specimen, keeps its bytes and where its last grid lies.
  void take(const std::string& name) {
    for (const VdbSpecimen& specimen : vdbCorpus())
      if (specimen.name == name) specimen.write(path());
    grid_ = checkVdb(path()).grids.back();
    bytes_ = contentsOf(path());
  }
  template <typename T>
  T get(uint64_t at) const {
    T value;
    std::memcpy(&value, &bytes_.at(at), sizeof value);
    return value;
  }
  template <typename T>
  void put(uint64_t at, T value) {
    std::memcpy(&bytes_.at(at), &value, sizeof value);
  }
  /// Replaces text by other text of its length, wherever it is.
  void replace(const std::string& from, const std::string& to) {
    ASSERT_EQ(from.size(), to.size());
    size_t count = 0;
    for (size_t at = bytes_.find(from); at != std::string::npos; at = bytes_.find(from, at + 1), ++count)
      bytes_.replace(at, from.size(), to);
    ASSERT_GT(count, 0u) << from;
  }
  /// Both the check and the reader refuse the bytes, with the path and these words.
  void expectRefused(std::initializer_list<std::string> words) {
    writeText(path(), bytes_);
    expectError(ExitStatus::kInputRefused, words, [&] { checkVdb(path()); });
    expectError(ExitStatus::kInputRefused, {path()}, [&] { VdbFile file(path()); });
  }
  std::string path() const { return folder_.file("in.vdb"); }

  TemporaryFolder folder_;
  VdbHeader::Grid grid_;
  std::string bytes_;
};

TEST_F(VdbStructure, SoundFilesOfEveryKindAreAcceptedAndRead) {
  for (const VdbSpecimen& specimen : vdbCorpus()) {
    SCOPED_TRACE(specimen.name);
    specimen.write(path());
    const VdbHeader header = checkVdb(path());
    for (const VdbHeader::Grid& grid : header.grids)
      EXPECT_EQ(grid.checked, grid.name != "drops") << grid.name;
    const VdbFile file(path());
    ASSERT_EQ(file.grids().size(), header.grids.size());
    for (const GridSummary& grid : file.grids()) {
      if (grid.readable) {
        EXPECT_NO_THROW(file.readCensus(grid.name)) << grid.name;
      }
    }
    EXPECT_EQ(file.readDensity().topology->activeVoxelCount(),
              11u * 11 * 11 + (specimen.name == "tiles" ? 512 : 0));
  }
}

TEST_F(VdbStructure, MemoryOfTreesIsForeseen) {
  for (const VdbSpecimen& specimen : vdbCorpus()) {
    SCOPED_TRACE(specimen.name);
    specimen.write(path());
    const VdbFile file(path());
    for (const VdbHeader::Grid& grid : checkVdb(path()).grids) {
      if (!grid.checked) continue;
      const double used = static_cast<double>(file.readGrid(grid.name)->memUsage());
      EXPECT_GE(2000 + 1.1 * static_cast<double>(grid.tree_bytes), used) << grid.name;
      EXPECT_LE(static_cast<double>(grid.tree_bytes), 1000 + 1.3 * used) << grid.name;
    }
  }
}

TEST_F(VdbStructure, TruncatedFilesAreRefusedAtEveryLength) {
  for (const char* name : {"zip", "half", "stream"}) {
    take(name);
    const std::string whole = bytes_;
    for (size_t length = 0; length < whole.size(); length += 1 + whole.size() / 300) {
      bytes_ = whole.substr(0, length);
      expectRefused({path()});
    }
  }
}

TEST_F(VdbStructure, VersionsThatItDoesNotKnowAreRefusedByNumber) {
  take("blosc");
  for (const uint32_t version : {221, 226}) {
    put(8, version);
    expectRefused({"VDB file version " + std::to_string(version), "222 to 225"});
  }
}

TEST_F(VdbStructure, FlagsAndCountsOfTheFrameAreSound) {
  take("blosc");
  const std::string whole = bytes_;
  put<char>(20, 2);  // whether the file has offsets
  expectRefused({"a yes or no that is 2"});
  bytes_ = whole;
  put<int32_t>(whole.find("density") - 8, -1);
  expectRefused({"-1 grids"});
  bytes_ = whole;
  put<uint32_t>(grid_.grid_position, 8);
  expectRefused({"density", "compression flags 8"});
  bytes_ = whole;
  replace("Tree_float_5_4_3", "Tree_fl0at_5_4_3");
  expectRefused({"density", "Tree_fl0at_5_4_3"});
}

TEST_F(VdbStructure, AnIdentifierThatOpenVdbWouldStumbleOverIsRefused) {
  take("blosc");
  put(21 + 3, ' ');
  expectRefused({"identifier"});
}

TEST_F(VdbStructure, MetadataHaveTheSizesOfTheirTypes) {
  take("blosc");
  const std::string whole = bytes_;
  const uint64_t frame = whole.find("frame") + 5 + 4 + 5;  // after its name and "int32"
  put<uint32_t>(frame, 8);
  expectRefused({"metadata frame of type int32 with 8 bytes"});
  put<uint32_t>(frame, 0xffffffff);
  expectRefused({"metadata frame"});
  bytes_ = whole;
  const uint64_t name = whole.find("frame") - 4;
  bytes_.replace(name, 9, std::string(4, '\0'));
  expectRefused({"metadata without a name"});
  bytes_ = whole;
  put<uint32_t>(name, 0x7fffffff);
  expectRefused({"a name of 2147483647 bytes"});
  bytes_ = whole;
  replace("file_compression", "is_local_space_x");
  replace("is_local_space_x", "file_compression");
  put<char>(bytes_.find("file_compression") + 16 + 4, 'S');  // no longer a string
  expectRefused({"density", "metadata file_compression of type String"});
}

TEST_F(VdbStructure, ListsForDelayedLoadingMustUnpackToWhatTheySay) {
  take("blosc");
  const uint64_t list = bytes_.find("__delayedload") + 13 + 4;
  ASSERT_EQ(get<uint32_t>(list), 8u);  // leaves
  put<uint32_t>(list, 9);
  expectRefused({"density"});
  put<uint32_t>(list, 0x7fffffff);
  expectRefused({"density", "delayed loading of 2147483647 leaves"});
}

TEST_F(VdbStructure, PackedListsForDelayedLoadingMustUnpackToWhatTheySay) {
  auto grid = openvdb::FloatGrid::create();
  for (int leaf = 0; leaf < 100; ++leaf) grid->tree().setValueOn(openvdb::Coord(8 * leaf, 0, 0), 1.f);
  corpus::write(path(), {grid});
  bytes_ = contentsOf(path());
  const std::string whole = bytes_;
  const uint64_t size = bytes_.find("__delayedload") + 13, leaves = size + 4, packed = leaves + 4;
  ASSERT_EQ(get<uint32_t>(leaves), 100u);
  ASSERT_GT(get<uint32_t>(packed), 16u);
  EXPECT_NO_THROW(VdbFile(path()).readGrid(checkVdb(path()).grids[0].name));
  put<uint32_t>(leaves, 60);
  expectRefused({"does not unpack"});
  bytes_ = whole;
  put<uint32_t>(packed + 4 + 4, 1 << 30);  // bytes that blosc says it unpacks to
  expectRefused({"does not unpack to 100 bytes"});
  bytes_ = whole;
  put<uint32_t>(size, get<uint32_t>(size) - 1);
  expectRefused({"longer than they say"});
}

TEST_F(VdbStructure, HalfFloatsAreWhatTypeAndMetadataAgreeOn) {
  take("half");
  put<char>(bytes_.rfind("is_saved_as_half_float") + 22 + 4 + 4 + 4, 0);
  expectRefused({"velocity", "16 bits"});
}

TEST_F(VdbStructure, TransformsAreOfKnownKinds) {
  take("blosc");
  const std::string whole = bytes_;
  replace("UniformScaleMap", "UniformScaleMop");
  expectRefused({"density", "UniformScaleMop"});
  take("frustum");
  replace("AffineMap", "FrustrMap");
  expectRefused({"camera", "FrustrMap"});
}

TEST_F(VdbStructure, OffsetsOfGridsAreInOrderAndTrue) {
  take("plain");
  const std::string whole = bytes_;
  const uint64_t offsets = grid_.grid_position - 3 * 8;
  ASSERT_EQ(get<uint64_t>(offsets), grid_.grid_position);
  put(offsets, grid_.block_position + 1);
  expectRefused({"density", "overlap"});
  put(offsets, grid_.grid_position);
  put(offsets + 8, grid_.block_position - 1);
  expectRefused({"density", "do not begin"});
  bytes_ = whole + "x";
  put(offsets + 16, grid_.end_position + 1);
  expectRefused({"density", "does not end"});
  put(offsets + 16, uint64_t(1) << 63);
  expectRefused({"density", "byte 9223372036854775808"});
}

TEST_F(VdbStructure, TheRootsCountsAndCornersAreHeldAgainstTheFile) {
  take("active");
  const std::string whole = bytes_;
  const uint64_t lower = grid_.block_position - kLeafMasks - 1 - kLowerMasks;
  const uint64_t corner = lower - 1 - kUpperMasks - kCorner, counts = corner - 8;
  ASSERT_EQ(get<int32_t>(corner), -4096);
  ASSERT_EQ(get<uint32_t>(counts + 4), 1u);
  put<uint32_t>(counts, 0xffffffff);  // tiles
  expectRefused({"density"});
  bytes_ = whole;
  put<uint32_t>(counts + 4, 0xffffffff);  // children
  expectRefused({"density"});
  bytes_ = whole;
  put<int32_t>(corner, -4095);
  expectRefused({"density", "-4095, no multiple of 4096"});
  bytes_ = whole;
  put<int32_t>(counts - 8, 2);  // buffers
  expectRefused({"density", "2 buffers"});
}

TEST_F(VdbStructure, RootCornersComeOnceAndInOrder) {
  take("tiles");
  // Two tiles of the root, (-8192,0,4096) and (4096,0,0), each with value and activity.
  const std::string corners[2] = {std::string("\0\xe0\xff\xff\0\0\0\0\0\x10\0\0", 12),
                                  std::string("\0\x10\0\0\0\0\0\0\0\0\0\0", 12)};
  const std::string whole = bytes_;
  replace(corners[0], corners[1]);
  expectRefused({"giant", "two tiles at (4096,0,0)"});
  bytes_ = whole;
  const std::string child("\0\xf0\xff\xff\0\xf0\xff\xff\0\xf0\xff\xff", 12);
  const uint64_t at = bytes_.rfind(child);
  bytes_.replace(at, 12, corners[1]);
  expectRefused({"giant", "(4096,0,0)"});
  bytes_ = whole;
  bytes_ = whole;
  bytes_.replace(bytes_.find(corners[1] + std::string("\0\0\0\x3f\1", 5)), 12,
                 child);  // of value 0.5, active
  expectRefused({"giant", "a node and a tile at (-4096,-4096,-4096)"});
  bytes_ = whole;
  put<int32_t>(at, 8192);  // behind the next
  expectRefused({"giant", "after one at (8192"});
}

TEST_F(VdbStructure, NoPlaceIsBothNodeAndActiveTile) {
  take("active");
  const uint64_t lower = grid_.block_position - kLeafMasks - 1 - kLowerMasks;
  std::memcpy(&bytes_[lower + kLowerMasks / 2], &bytes_[lower], kLowerMasks / 2);
  expectRefused({"density", "a node and an active tile"});
}

TEST_F(VdbStructure, LeavesAreActiveWhereTheTreeSays) {
  take("active");
  put<char>(grid_.block_position, static_cast<char>(get<char>(grid_.block_position) ^ 1));
  expectRefused({"density", "not active where the tree says"});
}

TEST_F(VdbStructure, ValuesAreOfAKnownKind) {
  take("active");
  for (const char kind : {7, -1}) {
    put(grid_.block_position + kLeafMask, kind);
    expectRefused({"density", "unknown kind " + std::to_string(kind)});
  }
}

TEST_F(VdbStructure, BloscChunksHoldTheirNodesValues) {
  take("blosc");
  const std::string whole = bytes_;
  const uint64_t length = grid_.block_position + kLeafMask + 1, chunk = length + 8;
  for (const int64_t wrong : {int64_t(-1), INT64_MIN}) {
    put(length, wrong);
    expectRefused({"density", "stores " + std::to_string(wrong)});
  }
  for (const int64_t wrong : {int64_t(1) << 40, INT64_MAX}) {
    put(length, wrong);
    expectRefused({"density", "a blosc chunk of " + std::to_string(wrong) + " bytes"});
  }
  put(length, int64_t(15));
  expectRefused({"density", "blosc chunk"});
  bytes_ = whole;
  put<uint32_t>(chunk + 4, get<uint32_t>(chunk + 4) + 4);  // bytes when unpacked
  expectRefused({"density", "blosc chunk"});
}

TEST_F(VdbStructure, ZipChunksUnpackToTheirNodesValues) {
  take("zip");
  const std::string whole = bytes_;
  const uint64_t length = grid_.block_position + kLeafMask + 1;
  const int64_t packed = get<int64_t>(length);
  ASSERT_GT(packed, 0);
  for (const int64_t wrong : {int64_t(-8), INT64_MIN}) {
    put(length, wrong);
    expectRefused({"density", "stores " + std::to_string(wrong)});
  }
  for (const int64_t wrong : {int64_t(1) << 40, INT64_MAX}) {
    put(length, wrong);
    expectRefused({"density", "a zip chunk of " + std::to_string(wrong) + " bytes"});
  }
  put(length, packed - 1);
  expectRefused({"density", "zip chunk"});
  bytes_ = whole;
  put<char>(length + 8 + static_cast<uint64_t>(packed) - 1, 0x55);  // of the checksum
  expectRefused({"density", "zip chunk"});
}

TEST_F(VdbStructure, BooleanLeavesLieWhereTheTreeSays) {
  take("every_type");
  for (const VdbHeader::Grid& grid : checkVdb(path()).grids) {
    if (grid.name != "wet" && grid.name != "mask") continue;
    const std::string whole = bytes_;
    put<int32_t>(grid.block_position + kLeafMask, 1 << 20);
    expectRefused({grid.name, "lies elsewhere"});
    bytes_ = whole;
  }
}

TEST_F(VdbStructure, InstancesNeedAGridToShare) {
  take("every_type");
  const std::string whole = bytes_;
  // The instance's own descriptor: its name, type and the name of the grid whose tree it has.
  const std::string type("\x10\0\0\0Tree_float_5_4_3\x07\0\0\0", 24);
  const uint64_t parent = bytes_.find(type + "density") + type.size();
  ASSERT_EQ(whole.substr(parent, 7), "density");
  for (const char* wrong : {"densitx", "int32\x1e\x30"}) {
    bytes_.replace(parent, 7, wrong);
    expectRefused({"shared", "shares the tree"});
  }
  bytes_ = whole;
  bytes_.replace(parent - 4, 11, std::string("\x06\0\0\0", 4) + "shared");  // itself; a byte shorter
  expectRefused({path()});
}

TEST_F(VdbStructure, PointsArePassedOverAndTheOthersRead) {
  take("points");
  const VdbFile file(path());
  EXPECT_FALSE(file.readDensity().topology->blockCount() == 0);
  expectError(ExitStatus::kInputRefused, {"in.vdb", "drops", "holds points"},
              [&] { file.readGrid("drops"); });
  // Their bytes never reach OpenVDB, so any will do.
  std::fill(bytes_.begin() + static_cast<long>(grid_.block_position), bytes_.end(), '\xff');
  writeText(path(), bytes_);
  EXPECT_NO_THROW(VdbFile(path()).readDensity());
}

TEST_F(VdbStructure, PointsThatThereAreNoneOfAreRead) {
  auto none = openvdb::points::PointDataGrid::create();
  none->setName("drops");
  corpus::write(path(), {none, corpus::fog()});
  const VdbFile file(path());
  EXPECT_EQ(file.readCensus("drops").active_voxels, 0u);
  EXPECT_EQ(file.readDensity().topology->activeVoxelCount(), 11u * 11 * 11);
}

TEST_F(VdbStructure, PointsInAStreamCannotBePassedOver) {
  std::ofstream out(path(), std::ios::binary);
  openvdb::io::Stream(out).write(openvdb::GridPtrVec{corpus::points()});
  out.close();
  expectError(ExitStatus::kInputRefused, {"in.vdb", "drops", "stream"}, [&] { VdbFile file(path()); });
}

}  // namespace
}  // namespace vdb_diffuse
