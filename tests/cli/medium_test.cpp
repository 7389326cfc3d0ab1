#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cli/lump_files.h"
#include "grid/volume_cut.h"
#include "io/image.h"
#include "medium/blackbody.h"

namespace vdb_diffuse {
namespace {

class MediumFlags : public LumpFiles {
 protected:
  /// Writes density and, where `temperature` is above 0, a temperature that grows with x.
  std::string write(const std::string& name, const Volume& density, double temperature = 0) {
    std::vector<OutputGrid> grids;
    grids.push_back({"density", "", {density.values}, {}});
    if (temperature > 0) {
      Field<float> kelvin(*density.topology);
      forEachVoxel(*density.topology, [&](Coord p, size_t i) {
        kelvin[i] = static_cast<float>(temperature * (1 + 0.1 * p[0]));
      });
      grids.push_back({"heat", "", {kelvin}, {}});
    }
    writeVdb(folder_.file(name), density, std::move(grids));
    return folder_.file(name);
  }
  Outcome bake(const std::string& inputs, const std::string& name, const std::string& flags) {
    const Outcome outcome = runProgram("bake " + inputs + out(name) + flags);
    EXPECT_EQ(outcome.status, 0) << outcome.error;
    return outcome;
  }
};

TEST_F(MediumFlags, ATemperatureGlowsAsTheRadianceOfABlackBody) {
  const Medium medium = lump();
  const std::string hot = write("hot.vdb", medium.density, 10);  // of 100 K each
  Channels Q(3, Field<float>(medium.topology()));
  forEachVoxel(medium.topology(), [&](Coord p, size_t i) {
    const Vec3d rgb = blackbodyRgb(100 * 10 * (1 + 0.1 * p[0]));
    for (int c = 0; c < 3; ++c) Q[c][i] = static_cast<float>(2 * rgb[c]);
  });
  bake(hot, "lit.vdb",
       "--sigma-a 0.5 --temperature heat --temperature-scale 100 --blackbody-intensity 2 --grids "
       "density,diffuse,direct --keep heat --tolerance 1e-6");
  const GridValues all = grid("lit.vdb", "diffuse");
  ASSERT_EQ(all.channels.size(), 3u);
  for (int c = 0; c < 3; ++c) {
    writeVdb(folder_.file("one.vdb"), medium.density,
             {{"density", "", {medium.density.values}, {}}, {"Q", "", {Q[c]}, {}}});
    bake(folder_.file("one.vdb"), "grey.vdb", "--sigma-a 0.5 --emission Q --tolerance 1e-6");
    const GridValues one = grid("grey.vdb", "diffuse");
    EXPECT_LT(largestDifference(*all.topology, all.channels[c], one.channels[0]), 1e-3) << c;
  }
  // By the scene file the same; and a picture of it glows.
  writeText(folder_.file("scene.json"),
            R"({"medium": {"sigma_a": 0.5, "temperature": "heat", "temperature_scale": 100,
                           "blackbody_intensity": 2}})");
  bake(hot, "scene.vdb", "--scene " + folder_.file("scene.json") + " --tolerance 1e-6");
  expectSame(grid("scene.vdb", "diffuse"), all, 1e-6);
  const auto brightness = [&](const std::string& flags) {
    const Outcome picture = runProgram("render " + folder_.file("lit.vdb") + out("lit.exr") + flags +
                                       "--size 8x8 --sigma-s 0 --ortho 1");
    EXPECT_EQ(picture.status, 0) << picture.error;
    return readExr(folder_.file("lit.exr")).pixels[36];
  };
  const Vec3f once = brightness(""), twice = brightness("--blackbody-intensity 4 ");
  EXPECT_GT(once[0], once[1]);
  EXPECT_NEAR(twice[0], 2 * once[0], 1e-4 * twice[0]);
}

TEST_F(MediumFlags, ReferenceAndReportKnowTheTemperatureToo) {
  const std::string hot = write("hot.vdb", lump().density, 1500);
  const std::string flags = "--sigma-a 0.5 --temperature heat ";
  bake(hot, "lit.vdb", flags + "--sweeps 4");
  const Outcome reference = runProgram("reference " + hot + out("mc.vdb") + flags + "--noise 0.02");
  ASSERT_EQ(reference.status, 0) << reference.error;
  const Outcome compared = runProgram("compare " + folder_.file("lit.vdb") + " " + folder_.file("mc.vdb") +
                                      " --block 4 --max-rms 0.03");
  EXPECT_EQ(compared.status, 0) << compared.out << compared.error;
  const Outcome report = runProgram("report " + hot + out("report") + flags + "--noise 0.1 --methods p1");
  EXPECT_EQ(report.status, 0) << report.error;
}

TEST_F(MediumFlags, GlowIsOfOneKind) {
  const std::string hot = write("hot.vdb", lump().density, 1500), lit = out("lit.vdb");
  expectRefusal(runProgram("bake " + hot + lit + "--temperature heat --emission heat"), 2,
                {"--emission", "--temperature"});
  expectRefusal(runProgram("bake " + hot + lit + "--temperature hat"), 3,
                {"no grid hat", "did you mean heat"});
  expectRefusal(runProgram("bake " + hot + lit + "--temperature heat --temperature-scale 1e9"), 3,
                {"hot.vdb", "heat", "K"});
  expectRefusal(runProgram("bake " + hot + lit + "--temperature heat --blackbody-intensity -1"), 2,
                {"--blackbody-intensity -1"});
  writeText(folder_.file("both.json"), R"({"medium": {"temperature": "heat", "emission": "heat"}})");
  expectRefusal(runProgram("bake " + hot + lit + "--scene " + folder_.file("both.json")), 3,
                {"both.json: medium: ", "either"});
  writeText(folder_.file("glow.json"), R"({"medium": {"sigma_a": 1, "emission": "none"}})");
  bake(hot, "lit.vdb", "--temperature heat --scene " + folder_.file("glow.json"));  // the flag replaces it
}

TEST_F(MediumFlags, CropAndLeastDensityLeaveTheRestOfTheMedium) {
  const Medium medium = lump();
  const std::string whole = write("whole.vdb", medium.density);
  VolumeCut how;
  how.least = 0.3;
  how.crop = WorldBox{Vec3d(0.5, -1, 0), Vec3d(2.1, 3, 2)};
  const std::string part = write("part.vdb", cut(medium.density, how));
  bake(part, "expected.vdb", "--sun 0,0,-1");
  bake(whole, "lit.vdb", "--sun 0,0,-1 --min-density 0.3 --crop 0.5,-1,0,2.1,3,2 --dilate 2 --half");
  bake(whole, "lit.vdb", "--sun 0,0,-1 --min-density 0.3 --crop 0.5,-1,0,2.1,3,2");
  for (const char* name : {"density", "diffuse", "direct"})
    expectSame(grid("lit.vdb", name), grid("expected.vdb", name), 1e-6);
  writeText(folder_.file("scene.json"), R"({"medium": {"min_density": 0.3, "crop": [0.5,-1,0,2.1,3,2]},
                                            "lights": [{"type": "sun", "direction": [0,0,-1]}]})");
  bake(whole, "scene.vdb", "--keep density --scene " + folder_.file("scene.json"));
  expectSame(grid("scene.vdb", "density"), grid("expected.vdb", "density"), 1e-6);
  const Outcome reference =
      runProgram("reference " + whole + out("mc.vdb") + "--sun 0,0,-1 --min-density 0.3 --samples 1000");
  EXPECT_EQ(reference.status, 0) << reference.error;
  EXPECT_LT(grid("mc.vdb", "diffuse").topology->activeVoxelCount(), medium.topology().activeVoxelCount());

  const std::string lit = out("x.vdb");
  expectRefusal(runProgram("bake " + whole + lit + "--crop 1,2,3"), 2, {"--crop 1,2,3", "x0,y0,z0,x1,y1,z1"});
  expectRefusal(runProgram("bake " + whole + lit + "--crop 1,2,3,0,4,5"), 2, {"--crop", "low corner"});
  expectRefusal(runProgram("bake " + whole + lit + "--min-density -1"), 2, {"--min-density -1"});
  writeText(folder_.file("bad.json"), R"({"medium": {"crop": [0,0,0,1,1]}})");
  expectRefusal(runProgram("bake " + whole + lit + "--scene " + folder_.file("bad.json")), 3,
                {"bad.json: medium.crop: ", "six numbers"});
}

// What widens the lighting grids, and halves their precision, leaves the density as it is.
TEST_F(MediumFlags, ADensityThatIsWrittenAnewIsNeitherWidenedNorRounded) {
  const std::string whole = write("whole.vdb", lump().density);
  bake(whole, "lit.vdb", "--sun 0,0,-1 --min-density 0.3");
  bake(whole, "wide.vdb", "--sun 0,0,-1 --min-density 0.3 --dilate 2 --half");
  expectSame(grid("wide.vdb", "density"), grid("lit.vdb", "density"), 1e-12);
  EXPECT_GT(grid("wide.vdb", "diffuse").topology->activeVoxelCount(),
            grid("lit.vdb", "diffuse").topology->activeVoxelCount());
}

TEST_F(MediumFlags, VolumesThatAreBakedTogetherAreOneMedium) {
  const Medium a = lump(), b = lump(Coord(7, 2, -3), 5);
  const std::string both = write("both.vdb", sum(a.density, b.density), 1000);
  Volume moved = lump(Coord(0), 5).density;  // b in a file whose origin is elsewhere
  moved.transform = Transform::uniform(0.25, Vec3d(7, 2, -3) * 0.25);
  const std::string first = write("first.vdb", a.density), second = write("second.vdb", moved);
  bake(both, "expected.vdb", "--sun 0.3,0,-1 --env 0.2");
  bake(first + " " + second, "lit.vdb", "--sun 0.3,0,-1 --env 0.2");
  for (const char* name : {"density", "diffuse", "direct"})
    expectSame(grid("lit.vdb", name), grid("expected.vdb", name), 1e-5);
  const Outcome reference =
      runProgram("reference " + first + " " + second + out("mc.vdb") + "--sun 0.3,0,-1 --samples 1000");
  EXPECT_EQ(reference.status, 0) << reference.error;

  const std::string lit = out("x.vdb");
  moved.transform = Transform::uniform(0.25, Vec3d(0.1, 0, 0));
  const std::string off = write("off.vdb", moved);
  expectRefusal(runProgram("bake " + first + " " + off + lit), 3, {"off.vdb", "grid density", "resample"});
  expectRefusal(runProgram("bake " + first + " " + folder_.file("none.vdb") + lit), 3, {"none.vdb"});
  expectRefusal(runProgram("bake " + first + " " + second + " -o " + second), 2, {"is the input itself"});
  expectRefusal(runProgram("bake " + first + " " + second + lit + "--temperature heat"), 3,
                {"first.vdb", "no grid heat"});
}

// Each part emits sigma_a rho Q of its own: where only one is hot, the other does not cool it.
TEST_F(MediumFlags, VolumesThatAreBakedTogetherGlowEachForItself) {
  const Medium a = lump();
  Volume cold = a.density, hot = a.density, twice = a.density;
  for (size_t i = 0; i < twice.values.size(); ++i) twice.values[i] *= 2;
  const std::string one = write("hot.vdb", hot, 1500), other = write("cold.vdb", cold),
                    together = write("twice.vdb", twice, 1500);
  const std::string flags = "--sigma-a 0.5 --temperature heat --tolerance 1e-6 ";
  bake(other + " " + one, "lit.vdb", flags);
  bake(together, "expected.vdb", flags + "--blackbody-intensity 0.5");
  expectSame(grid("lit.vdb", "diffuse"), grid("expected.vdb", "diffuse"), 1e-4);
}

TEST_F(MediumFlags, ADryRunSaysWhatABakeWouldTakeAndWritesNothing) {
  const Medium medium = lump();
  const std::string volume = write("cloud.0001.vdb", medium.density, 1500);
  const size_t before = folder_.fileCount();
  const std::string bake = "bake " + volume + out("lit.vdb") + "--dry-run --sun 0,0,-1 ";
  const Outcome outcome = runProgram(bake + "--temperature heat --stats " + folder_.file("s.json"));
  EXPECT_EQ(outcome.status, 0) << outcome.error;
  for (const std::string& word : {std::string("cloud.0001.vdb"), std::string("density and heat"),
                                  std::to_string(medium.topology().activeVoxelCount()) + " active voxels",
                                  std::string("GiB"), std::string("nothing is written")})
    EXPECT_NE(outcome.out.find(word), std::string::npos) << word << " in: " << outcome.out;
  EXPECT_EQ(folder_.fileCount(), before);
  EXPECT_NE(runProgram(bake + "--min-density 100").out.find("; 0 active voxels"), std::string::npos);
  expectRefusal(runProgram(bake + "--temperature hat"), 3, {"no grid hat"});
  expectRefusal(runProgram(bake + "--sweeps 3 --model paper"), 2, {"--model paper"});
  const Outcome frames = runProgram("bake '" + folder_.file("cloud.####.vdb") + "' -o '" +
                                    folder_.file("lit.####.vdb") + "' --frames 1-2 --dry-run --sun 0,0,-1");
  expectRefusal(frames, 3, {"frame 2", "cloud.0002.vdb"});
  EXPECT_NE(frames.out.find("1 of 2 frames can be baked, not: 2"), std::string::npos) << frames.out;
  EXPECT_EQ(folder_.fileCount(), before);
}

}  // namespace
}  // namespace vdb_diffuse
