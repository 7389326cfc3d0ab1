#include "phases.h"

#include <openvdb/openvdb.h>
#include <tbb/global_control.h>

#include <unistd.h>
#include <cstdio>
#include <filesystem>
#include <functional>

#include "cloud_system.h"
#include "io/vdb_writer.h"
#include "medium/directions.h"
#include "medium/sweep.h"
#include "multigrid/solve.h"
#include "stopwatch.h"

namespace vdb_diffuse::speed {
namespace {

/// Files of the runs, removed at the end.
class Scratch {
 public:
  Scratch()
      : folder_(std::filesystem::temp_directory_path() / ("vdb_diffuse_speed_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~Scratch() { std::filesystem::remove_all(folder_); }
  Scratch(const Scratch&) = delete;
  std::string file(const std::string& name) const { return (folder_ / name).string(); }

 private:
  std::filesystem::path folder_;
};

// Bytes per stored voxel: fields that a step reads and writes, in passes over memory. The first scatter reads
// density and adds to the light. A V-cycle's down-stroke reads four fields and writes one, its up-stroke
// reads five and writes two, and coarse levels are an eighth, a 64th.. of it; an iteration has the recurrence
// besides. A direction of a sweep reads depth, source and its slopes and adds to mean and divergence.
constexpr double kSource = 3 * 4, kCycle = 12 * 4 * 8.0 / 7, kRecurrence = 9 * 4 + 2 * 8;
constexpr double kSweepDirection = (5 + 2 * 2) * 4;

class Timer {
 public:
  Timer(size_t voxels, const PhaseSettings& settings)
      : system_(makeCloudSystem(voxels, false)), settings_(settings) {
    result_.voxels = system_.voxels();
    result_.fill = system_.fill();
  }

  Phases run() {
    const KeepArrays arrays;  // as in a bake
    for (const int threads : settings_.threads) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      threads_ = threads;
      files();
      topology();
      source();
      solver();
      sweeps();
    }
    return std::move(result_);
  }

 private:
  CloudSystem system_;
  const PhaseSettings& settings_;
  Phases result_;
  int threads_ = 1;

  /// \param bytes  per stored voxel
  void time(const std::string& name, double bytes, const std::function<void()>& work) {
    std::vector<double> seconds;
    for (int i = 0; i < settings_.repeats; ++i) {
      const Stopwatch watch;
      work();
      seconds.push_back(watch.read().wall);
    }
    result_.times.push_back(
        {name, threads_, 1e9 * median(seconds) / static_cast<double>(result_.voxels), bytes / result_.fill});
  }

  void files() {
    const Scratch scratch;
    const Volume& density = system_.medium.density;
    const std::string ours = scratch.file("ours.vdb"), theirs = scratch.file("theirs.vdb");
    std::vector<std::vector<OutputGrid>> lighting(static_cast<size_t>(settings_.repeats));
    for (std::vector<OutputGrid>& grids : lighting)
      for (const char* name : {"diffuse", "direct"}) grids.push_back({name, "", {density.values}, {}});
    time("write", 0, [&] {
      writeVdb(ours, density, std::move(lighting.back()));
      lighting.pop_back();
    });
    openvdb::GridPtrVec grids;
    {
      openvdb::io::File file(ours);
      file.open(false);
      grids = *file.getGrids();
    }
    time("  OpenVDB's File::write", 0, [&] { openvdb::io::File(theirs).write(grids); });
    writeVolume(ours, density);
    time("read", 0, [&] { VdbFile(ours).readDensity(); });
    time("  OpenVDB's File::readGrid", 0, [&] {
      openvdb::io::File file(ours);
      file.open(false);
      file.readGrid(density.name);
    });
  }

  void topology() {
    const Topology& t = system_.medium.topology();
    time("topology", 0, [&] {
      std::vector<Coord> origins;
      std::vector<BlockMask> active;
      for (size_t b = 0; b < t.blockCount(); ++b) {
        origins.push_back(t.origin(b));
        active.push_back(t.active(b));
      }
      Topology(std::move(origins), std::move(active));
    });
  }

  void source() {
    Scene scene;
    scene.lights.push_back({"sun", SunLight{Vec3d(1, 0.5, -1).unit()}});
    const Occluder nothing(scene.surfaces);
    time("first scatter, a sun", kSource,
         [&] { firstScatter(system_.medium, scene, nothing, Model::kDefault); });
  }

  void solver() {
    const Equation& e = system_.equation;
    const Field<float> Q0(system_.medium.topology(), 1.0f);
    time("returned light", 0, [&] { returnedLight(system_.medium, e.optics); });
    time("equation", 0, [&] { formEquation(system_.medium, e.optics, 0, Model::kDefault, e.settings); });
    time("right-hand side", 0, [&] { formRightHandSide(e, system_.medium, {&Q0}); });
    time("multigrid setup", 0, [&] { Multigrid multigrid(e.A); });
    Multigrid multigrid(e.A);
    Field<float> z(*e.A->topology), Az(*e.A->topology);
    time("one V-cycle", kCycle, [&] { multigrid.precondition(system_.b, z, Az); });
    for (const double tolerance : settings_.tolerances) {
      SolveSettings solving;
      solving.tolerance = tolerance;
      Field<double> x(*e.A->topology);
      int iterations = 0;
      const auto work = [&] {
        x.fill(0);
        iterations = solve(multigrid, system_.b, x, solving).iterations;
      };
      char name[60];
      std::snprintf(name, sizeof name, "solve to %.0e", tolerance);
      time(name, 0, work);
      result_.times.back().name += " (" + std::to_string(iterations) + " iterations)";
      result_.times.back().bytes = iterations * (kCycle + kRecurrence) / result_.fill;
    }
  }

  void sweeps() {
    constexpr int kDirections = 96;
    const Wavefront wavefront(system_.medium.density.topology, Vec3d(1), halfRangeSet(kDirections));
    SweepSource source;
    source.tau = source.J = system_.medium.density.values;
    for (Field<float>& component : source.slope) component = Field<float>(system_.medium.topology());
    time("a sweep's direction", kSweepDirection, [&] { sweep(wavefront, source, 0); });
    result_.times.back().ns /= kDirections;
  }
};

}  // namespace

Phases timePhases(size_t voxels, const PhaseSettings& settings) {
  return Timer(voxels, settings).run();
}

}  // namespace vdb_diffuse::speed
