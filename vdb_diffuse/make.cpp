#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "commands.h"
#include "example.h"
#include "io/vdb_writer.h"
#include "shapes/blobs.h"
#include "shapes/cloud.h"
#include "shapes/solids.h"

namespace vdb_diffuse {
namespace {

/// All that `make` can be told; each shape offers the part that it heeds.
struct MakeFlags {
  std::string output;
  double voxels = 1e6, voxel_size = NAN, density = NAN, contrast = 1e6, cell = NAN, depth = 1, count = 24;
  int64_t seed = 1;
};

std::string printed(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", v);
  return text;
}

/// The flag's value if it lies within limits (both allowed), else a UsageError that names both.
double within(const char* flag, double value, double low, double high) {
  if (value >= low && value <= high) return value;
  throw UsageError(std::string(flag) + " " + printed(value) + ": give a number from " + printed(low) +
                   " to " + printed(high));
}

double wholeWithin(const char* flag, double value, double low, double high) {
  if (within(flag, value, low, high) == std::floor(value)) return value;
  throw UsageError(std::string(flag) + " " + printed(value) + ": give a whole number");
}

constexpr double kMost = 1e20;  // so that no product or quotient of two flags leaves the range of a float

ShapeSize sizeOf(const MakeFlags& flags) {
  ShapeSize size;
  size.voxels = static_cast<size_t>(wholeWithin("--voxels", flags.voxels, 1, 1e15));
  if (!std::isnan(flags.voxel_size)) size.voxel_size = within("--voxel-size", flags.voxel_size, 1e-9, 1e9);
  return size;
}

double densityOf(const MakeFlags& flags, double usual) {
  return std::isnan(flags.density) ? usual : within("--density", flags.density, 0, kMost);
}

int cellOf(const MakeFlags& flags, int usual) {
  return std::isnan(flags.cell) ? usual : static_cast<int>(wholeWithin("--cell", flags.cell, 1, 1e6));
}

void writeShape(const std::string& shape, const MakeFlags& flags, const Volume& volume) {
  writeVolume(flags.output, volume,
              {{"creator", "vdb_diffuse " VDB_DIFFUSE_VERSION},
               {"shape", shape},
               {"voxels_asked", printed(flags.voxels)},
               {"seed", std::to_string(flags.seed)}});
  std::printf("%s: %s, %zu active voxels in %zu blocks, voxel size %.6g\n", flags.output.c_str(),
              shape.c_str(), volume.topology->activeVoxelCount(), volume.topology->blockCount(),
              volume.transform.meanVoxelSize());
}

using Maker = std::function<Volume(const MakeFlags&)>;

/// Adds a shape with the flags that all have.
CLI::App* addShape(CLI::App& make, const std::shared_ptr<MakeFlags>& flags, const std::string& name,
                   const std::string& description, const Maker& maker) {
  CLI::App* shape = make.add_subcommand(name, description);
  setExample(shape, "vdb_diffuse make " + name + " -o " + name + ".vdb --voxels 200000");
  shape->add_option("-o,--output", flags->output, "the VDB file to write")->required();
  shape->add_option("--voxels", flags->voxels, "active voxels to aim at (1000000)");
  shape->add_option(
      "--voxel-size", flags->voxel_size,
      "world units; scales the world, and with it all optical depths (default: from the shape's "
      "own width)");
  shape->add_option("--seed", flags->seed,
                    "another number, another cloud or other blobs; the rest stay the same (1)");
  shape->callback([=] { writeShape(name, *flags, maker(*flags)); });
  return shape;
}

void addDensity(CLI::App* shape, const std::shared_ptr<MakeFlags>& flags, const std::string& meaning) {
  shape->add_option("--density", flags->density, meaning);
}

void addCell(CLI::App* shape, const std::shared_ptr<MakeFlags>& flags, const std::string& meaning) {
  shape->add_option("--cell", flags->cell, meaning);
}

}  // namespace

void addMake(CLI::App& program, ExitStatus&) {
  CLI::App* make = program.add_subcommand(
      "make", "Test volumes: cloud, sphere, box, shell, layers, checkerboard, sheet, blobs");
  setExample(make, "vdb_diffuse make cloud -o cloud.vdb --voxels 1e6 --seed 3");
  make->footer(
      "The grid is `density`, with about --voxels active voxels. A shape keeps its width of about 10 world\n"
      "units however many voxels show it, so that --voxels is its resolution; optical depths above are for\n"
      "sigma_s 1 and that width. Each shape has --help of its own.\n\n" +
      make->get_footer());
  make->require_subcommand(1);
  const auto flags = std::make_shared<MakeFlags>();

  CLI::App* cloud =
      addShape(*make, flags, "cloud",
               "a cumulus about 11 wide and 5 high, z up, base at z = 0, with wisps and detached pieces; "
               "20 to 30 optical depths along its longest chords",
               [](const MakeFlags& f) {
                 return makeCloud({sizeOf(f), static_cast<uint64_t>(f.seed), densityOf(f, 5)});
               });
  addDensity(cloud, flags, "highest density (5)");

  CLI::App* sphere = addShape(*make, flags, "sphere", "a solid ball of diameter 10; 10 optical depths across",
                              [](const MakeFlags& f) { return makeSphere(sizeOf(f), densityOf(f, 1)); });
  addDensity(sphere, flags, "density (1)");

  CLI::App* box =
      addShape(*make, flags, "box", "a solid block, nearly a cube of side 10; 10 optical depths across",
               [](const MakeFlags& f) { return makeBox(sizeOf(f), densityOf(f, 1)); });
  addDensity(box, flags, "density (1)");

  CLI::App* shell =
      addShape(*make, flags, "shell",
               "a ball of diameter 10 with a cavity of diameter 5 that is active and holds zero; "
               "5 optical depths across the middle",
               [](const MakeFlags& f) { return makeShell(sizeOf(f), densityOf(f, 1)); });
  addDensity(shell, flags, "density of the shell (1)");

  CLI::App* layers =
      addShape(*make, flags, "layers",
               "nearly a cube of side 10 in horizontal slabs, by turns of density and of active zero",
               [](const MakeFlags& f) { return makeLayers(sizeOf(f), densityOf(f, 1), cellOf(f, 0)); });
  addDensity(layers, flags, "density of every other slab (1)");
  addCell(layers, flags, "thickness of a slab in voxels (default: an eighth of the height)");

  CLI::App* checkerboard =
      addShape(*make, flags, "checkerboard",
               "nearly a cube of side 10 in small cubes of two densities by turns", [](const MakeFlags& f) {
                 return makeCheckerboard(sizeOf(f), densityOf(f, 1),
                                         within("--contrast", f.contrast, 0, 1e15), cellOf(f, 1));
               });
  addDensity(checkerboard, flags, "the one density (1)");
  checkerboard->add_option("--contrast", flags->contrast, "the other density over the first (1e6)");
  addCell(checkerboard, flags, "side of the small cubes in voxels (1)");

  CLI::App* sheet =
      addShape(*make, flags, "sheet",
               "one layer of voxels, nearly a square of side 10 across z; 1 optical depth thick",
               [](const MakeFlags& f) { return makeSheet(sizeOf(f), within("--depth", f.depth, 0, kMost)); });
  sheet->add_option("--depth", flags->depth, "density times thickness (1)");

  CLI::App* blobs = addShape(*make, flags, "blobs", "a sum of Gaussian blobs scattered over a cube of side 7",
                             [](const MakeFlags& f) {
                               const int count = static_cast<int>(wholeWithin("--count", f.count, 1, 10000));
                               return makeBlobs({sizeOf(f), uint64_t(f.seed), count, densityOf(f, 10)});
                             });
  addDensity(blobs, flags, "highest density of a single blob (10)");
  blobs->add_option("--count", flags->count, "number of blobs, 1 to 10000 (24)");
}

}  // namespace vdb_diffuse
