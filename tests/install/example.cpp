// The library in one page: reads a volume, lights it from above, writes what a renderer needs.
#include <iostream>

#include "grid/error.h"
#include "io/vdb_writer.h"
#include "transport/illuminate.h"

using namespace vdb_diffuse;

int main(int argc, char** argv) try {
  if (argc != 3) throw UsageError("usage: example IN.vdb OUT.vdb");
  const VdbFile file(argv[1]);
  Medium medium;
  medium.density = file.readDensity();
  medium.optics.g = 0.6;

  Scene scene;
  scene.lights.push_back({"sun", SunLight{Vec3d(0, 0, -1), Vec3d(3), 0}});  // direction, W/m^2, angle
  DiffuseResult lit = illuminate(medium, scene, {}, {});

  std::vector<OutputGrid> grids;
  grids.push_back({"diffuse", "W/m^2/sr", std::move(lit.diffuse), {}});
  grids.push_back({"direct", "W/m^2/sr", std::move(lit.direct), {}});
  writeVdb(argv[2], medium.density, std::move(grids), {}, &file, {medium.density.name});
  std::cout << "energy closes to " << std::abs(lit.energy.closure()) << "\n";
  return lit.converged ? 0 : 4;
} catch (const Error& error) {
  std::cerr << error.what() << "\n";
  return static_cast<int>(error.status());
}
