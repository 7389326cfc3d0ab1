#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <nlohmann/json.hpp>

#include "cli/lump_files.h"
#include "grid/volume_cut.h"
#include "io/image.h"

namespace vdb_diffuse {
namespace {

/// The lump with a grid Cd, red below and blue above.
class AlbedoGridFlag : public LumpFiles {
 protected:
  static Vec3f colour(const Coord& p) { return p[2] < 6 ? Vec3f(1, 0.25f, 0.25f) : Vec3f(0.25f, 0.5f, 1); }
  static Channels channels(const Topology& topology, const std::function<Vec3f(Coord)>& at) {
    Channels result(3, Field<float>(topology));
    forEachVoxel(topology, [&](Coord p, size_t i) {
      for (int c = 0; c < 3; ++c) result[c][i] = at(p)[c];
    });
    return result;
  }
  /// Density and further grids.
  std::string write(const std::string& name, const Volume& density, std::vector<OutputGrid> grids) {
    grids.insert(grids.begin(), {"density", "", {density.values}, {}});
    writeVdb(folder_.file(name), density, std::move(grids));
    return folder_.file(name);
  }
  std::string writeColoured(const std::string& name) {
    const Medium medium = lump();
    return write(name, medium.density, {{"Cd", "", channels(medium.topology(), colour), {}}});
  }
  Outcome run(const std::string& command) {
    const Outcome outcome = runProgram(command);
    EXPECT_EQ(outcome.status, 0) << command << ": " << outcome.error;
    return outcome;
  }
};

TEST_F(AlbedoGridFlag, LitsAVolumeThatRendersAlone) {
  const std::string volume = writeColoured("in.vdb");
  run("bake " + volume + out("lit.vdb") + "--sun 0,0,-1 --albedo-grid Cd");
  expectSame(grid("lit.vdb", "Cd"), grid("in.vdb", "Cd"), 1e-9);
  EXPECT_EQ(grid("lit.vdb", "diffuse").channels.size(), 3u);
  writeText(folder_.file("scene.json"), R"({"medium": {"albedo_grid": "Cd"},
                                            "lights": [{"type": "sun", "direction": [0,0,-1]}]})");
  run("bake " + volume + out("scene.vdb") + "--scene " + folder_.file("scene.json"));
  expectSame(grid("scene.vdb", "diffuse"), grid("lit.vdb", "diffuse"), 1e-9);

  // Red in the lower half of a view from the side, blue in the upper; and grey without the grid.
  const auto view = [&](const std::string& file) {
    run("render " + folder_.file(file) + out("view.exr") + "--from 1.4,-9,1.4 --size 16x16 --ortho 3");
    return readExr(folder_.file("view.exr"));
  };
  const Image image = view("lit.vdb");
  const Vec3f below = image.pixels[12 * 16 + 8], above = image.pixels[3 * 16 + 8];
  EXPECT_GT(below[0], 2 * below[2]);
  EXPECT_GT(above[2], 2 * above[0]);
  run("bake " + volume + out("bare.vdb") +
      "--sun 0,0,-1 --albedo-grid Cd --grids diffuse,direct --keep density");
  const Outcome bare = runProgram("render " + folder_.file("bare.vdb") + out("bare.exr") + "--size 8x8");
  EXPECT_NE(bare.error.find("no grid Cd"), std::string::npos) << bare.error;
}

// A picture of one half everywhere is that of half the albedo.
TEST_F(AlbedoGridFlag, OneValueEverywhereLooksLikeThatAlbedo) {
  const Medium medium = lump();
  const std::string volume =
      write("half.vdb", medium.density, {{"half", "", {Field<float>(medium.topology(), 0.5f)}, {}}});
  const std::string light = "--sun 0.2,0.3,-1 --env 0.2 --g 0.5 --tolerance 1e-6 ";
  const std::string grids = "--grids density,diffuse,direct,flux,source ";
  run("bake " + volume + out("with.vdb") + light + grids + "--sigma-s 2 --albedo-grid half");
  run("bake " + volume + out("without.vdb") + light + grids + "--sigma-s 1 --sigma-a 1");
  for (const char* name : {"diffuse", "direct", "flux", "source"})
    expectSame(grid("with.vdb", name), grid("without.vdb", name), 1e-4);
  const auto view = [&](const std::string& file) {
    run("render " + folder_.file(file) + out("view.exr") + "--size 24x24");
    return readExr(folder_.file("view.exr"));
  };
  const Image a = view("with.vdb"), b = view("without.vdb");
  for (size_t i = 0; i < a.pixels.size(); ++i)
    EXPECT_NEAR(a.pixels[i][0], b.pixels[i][0], 1e-4 * (0.1 + b.pixels[i][0])) << i;
}

TEST_F(AlbedoGridFlag, ReferenceAndReportKnowItToo) {
  const std::string volume = writeColoured("in.vdb"), flags = "--sun 0.3,0,-1 --albedo-grid Cd ";
  run("bake " + volume + out("lit.vdb") + flags + "--sweeps 4");
  run("reference " + volume + out("mc.vdb") + flags + "--noise 0.02");
  const Outcome compared = runProgram("compare " + folder_.file("lit.vdb") + " " + folder_.file("mc.vdb") +
                                      " --block 4 --max-rms 0.03");
  EXPECT_EQ(compared.status, 0) << compared.out << compared.error;
  run("report " + volume + out("report") + flags + "--methods p1,blobs --reference " +
      folder_.file("mc.vdb"));
  expectRefusal(runProgram("report " + volume + out("other") + "--sun 0.3,0,-1 --methods p1 --reference " +
                           folder_.file("mc.vdb")),
                3, {"mc.vdb", "with an albedo grid"});
}

TEST_F(AlbedoGridFlag, SaysWhatItChangedAndWhatWasMissing) {
  const Medium medium = lump();
  Volume part = medium.density;
  VolumeCut how;
  how.crop = WorldBox{Vec3d(-1, -1, -1), Vec3d(9, 9, 2)};
  part = cut(part, how);
  const uint64_t outside = medium.topology().activeVoxelCount() - part.topology->activeVoxelCount();
  uint64_t bright = 0;
  const Channels Cd = channels(*part.topology, [&](Coord p) {
    bright += p[0] == 3;
    return p[0] == 3 ? Vec3f(1, 1, 1.5f) : Vec3f(1, 0.5f, 0.5f);
  });
  const auto Cd_grid = gridOf(*part.topology, Cd, part.transform);
  Cd_grid->setName("Cd");
  const auto density = gridOf(medium.topology(), {medium.density.values}, medium.transform());
  density->setName("density");
  density->setGridClass(openvdb::GRID_FOG_VOLUME);
  openvdb::io::File(folder_.file("in.vdb")).write(openvdb::GridCPtrVec{density, Cd_grid});
  const std::string stats = folder_.file("s.json");
  run("bake " + folder_.file("in.vdb") + out("lit.vdb") + "--sun 0,0,-1 --albedo-grid Cd --stats " + stats);
  const auto warnings = nlohmann::json::parse(contentsOf(stats))["warnings"];
  ASSERT_EQ(warnings.size(), 2u) << warnings;
  const std::string clamped = warnings[0], missing = warnings[1];
  for (const std::string& word :
       {std::string("in.vdb: grid Cd"), std::to_string(bright / 3) + " voxels", std::string("0..1")})
    EXPECT_NE(clamped.find(word), std::string::npos) << word << " in: " << clamped;
  for (const std::string& word :
       {std::string("in.vdb: grid Cd"), std::to_string(outside) + " voxels", std::string("0,0,0")})
    EXPECT_NE(missing.find(word), std::string::npos) << word << " in: " << missing;
  // There nothing scatters: no light of its own.
  const GridValues lit = grid("lit.vdb", "diffuse");
  EXPECT_GT(lit.channels[0].at(*lit.topology, Coord(4, 4, 4)), 0);

  const auto info = nlohmann::json::parse(run("info --json " + folder_.file("in.vdb")).out)["grids"][0];
  EXPECT_EQ(info["name"], "Cd");
  EXPECT_EQ(info["albedo"]["outside"], outside);
  EXPECT_EQ(info["albedo"]["clamped"], bright / 3);
  EXPECT_EQ(info["background"], (std::vector<double>{0, 0, 0}));
  EXPECT_EQ(info["values"]["components"][2], (std::vector<double>{0.5, 1.5}));
  EXPECT_NE(run("info " + folder_.file("in.vdb")).out.find("--albedo-grid Cd"), std::string::npos);
}

TEST_F(AlbedoGridFlag, RefusesWhatIsNoAlbedo) {
  const Medium medium = lump();
  Channels bad(1, Field<float>(medium.topology(), NAN));
  const std::string volume = write("in.vdb", medium.density, {{"bad", "", bad, {}}});
  const std::string bake = "bake " + volume + out("lit.vdb") + "--sun 0,0,-1 ";
  expectRefusal(runProgram(bake + "--albedo-grid bad"), 3, {"in.vdb: grid bad", "nan", "--clamp"});
  run(bake + "--albedo-grid bad --clamp");
  expectRefusal(runProgram(bake + "--albedo-grid Cd"), 3, {"in.vdb", "no grid Cd"});
  writeText(folder_.file("scene.json"), R"({"medium": {"albedo_grid": 3}})");
  expectRefusal(runProgram("bake " + volume + out("lit.vdb") + "--scene " + folder_.file("scene.json")), 3,
                {"medium.albedo_grid"});
}

// The grid follows the voxels that are left, those of larger voxels and those of several volumes.
TEST_F(AlbedoGridFlag, CropCoarsenSeveralVolumesAndFrames) {
  const std::string volume = writeColoured("in.0001.vdb");
  const std::string flags = "--sun 0,0,-1 --albedo-grid Cd --g 0.4 ";
  run("bake " + volume + out("cropped.vdb") + flags + "--crop 0,0,0,9,9,1.3 --min-density 0.3");
  const GridValues lit = grid("cropped.vdb", "diffuse"), Cd = grid("cropped.vdb", "Cd");
  EXPECT_EQ(Cd.topology->activeVoxelCount(), lit.topology->activeVoxelCount());
  EXPECT_EQ(Cd.channels[1].at(*Cd.topology, Cd.topology->activeBox().first), 0.25f);
  run("bake " + volume + out("coarse.vdb") + flags + "--coarsen 1");
  EXPECT_LT(grid("coarse.vdb", "diffuse").topology->activeVoxelCount(), lump().topology().activeVoxelCount());
  run("render " + folder_.file("coarse.vdb") + out("coarse.png") + "--size 16x16");

  // Half of the density in each of two files is the whole in one; one file with no grid is white.
  const Medium medium = lump();
  Volume half = medium.density;
  for (size_t i = 0; i < half.values.size(); ++i) half.values[i] *= 0.5f;
  const std::string first = write("a.vdb", half, {{"Cd", "", channels(*half.topology, colour), {}}});
  const std::string second = write("b.vdb", half, {});
  write("both.vdb", medium.density,
        {{"Cd", "", channels(medium.topology(), [](Coord p) { return (colour(p) + Vec3f(1)) * 0.5f; }), {}}});
  run("bake " + first + " " + first + out("twice.vdb") + flags);
  run("bake " + volume + out("once.vdb") + flags);
  expectSame(grid("twice.vdb", "diffuse"), grid("once.vdb", "diffuse"), 1e-5);
  run("bake " + first + " " + second + out("mixed.vdb") + flags);
  run("bake " + folder_.file("both.vdb") + out("expected.vdb") + flags);
  expectSame(grid("mixed.vdb", "diffuse"), grid("expected.vdb", "diffuse"), 1e-5);
  expectSame(grid("mixed.vdb", "Cd"), grid("both.vdb", "Cd"), 1e-6);
  expectRefusal(runProgram("bake " + second + " " + second + out("x.vdb") + flags), 3,
                {"b.vdb", "no grid Cd"});

  run("bake '" + folder_.file("in.####.vdb") + "' -o '" + folder_.file("lit.####.vdb") + "' --frames 1 " +
      flags);
  expectSame(grid("lit.0001.vdb", "diffuse"), grid("once.vdb", "diffuse"), 1e-9);
  const Outcome dry = run("bake " + volume + out("x.vdb") + flags + "--dry-run");
  EXPECT_NE(dry.out.find("grid density and Cd"), std::string::npos) << dry.out;
}

// Each part emits sigma_a rho Q of its own, and a dark part absorbs more.
TEST_F(AlbedoGridFlag, VolumesThatAreBakedTogetherGlowEachForItself) {
  const Medium medium = lump();
  const Field<float> dark(medium.topology(), 0.25f), white(medium.topology(), 1), flame(medium.topology(), 2);
  Medium whole = medium;
  const std::string glows =
      write("glows.vdb", medium.density, {{"Cd", "", {dark}, {}}, {"flame", "", {flame}, {}}});
  const std::string cold = write("cold.vdb", medium.density, {{"Cd", "", {white}, {}}});
  for (size_t i = 0; i < whole.density.values.size(); ++i) whole.density.values[i] *= 2;
  // sigma_a of the parts: 0.1 + 0.75 and 0.1; together 2 (0.1 + 0.375), of which 0.85 glow
  const Field<float> mean(medium.topology(), 0.625f), part(medium.topology(), 2 * 0.85f / 0.95f);
  const std::string one =
      write("one.vdb", whole.density, {{"Cd", "", {mean}, {}}, {"flame", "", {part}, {}}});
  const std::string flags = "--sigma-a 0.1 --emission flame --albedo-grid Cd --tolerance 1e-6 ";
  run("bake " + glows + " " + cold + out("lit.vdb") + flags);
  run("bake " + one + out("expected.vdb") + flags);
  expectSame(grid("lit.vdb", "diffuse"), grid("expected.vdb", "diffuse"), 1e-4);
}

}  // namespace
}  // namespace vdb_diffuse
