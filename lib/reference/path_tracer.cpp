#include "reference/path_tracer.h"

#include <tbb/info.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <mutex>

#include "grid/error.h"
#include "reference/path.h"
#include "reference/schedule.h"
#include "reference/spread_points.h"
#include "scene/colour.h"

namespace vdb_diffuse {
namespace {

using Clock = std::chrono::steady_clock;

/// Noise is an estimate as well, from this many batches at least; and however short the time, so many are
/// done, for without them there is no standard error.
constexpr uint64_t kTrustedBatches = 32, kFewestBatches = 4;
/// Paths of the trial before the first batch, and what the start of a ray and a collision cost, in voxels.
constexpr uint64_t kTrialPaths = 1024, kRayVoxels = 30, kCollisionVoxels = 8;
/// On a cumulus of 120,000 voxels, where sqrt(r / w) = 0.7, noise^2 x time was 178, 161, 139, 137 and 162 for
/// 1, 2, 4, 8 and 16 walkers.
constexpr double kWalkers = 4;
constexpr uint64_t kPathsBetweenLooks = 64;  // at the clock and for an interrupt

int channelsOf(const Medium& medium, const Scene& scene) {
  return medium.grey() && greyScene(scene) ? 1 : 3;
}

/// Sums and one batch must fit; what else is kept is small beside them.
void checkMemory(const Medium& medium, int channels, const ReferenceSettings& settings) {
  const double need = Tally::bytesOfSums(medium.topology(), channels, settings.want_flux) +
                      Tally::bytesPerBatch(medium.topology(), channels, settings.want_flux);
  if (settings.max_bytes == 0 || need <= static_cast<double>(settings.max_bytes)) return;
  constexpr double kGiB = 1024.0 * 1024 * 1024;
  char line[160];
  std::snprintf(line, sizeof line,
                "paths through it take %.2f GiB and %.2f GiB are free; use a coarser volume", need / kGiB,
                static_cast<double>(settings.max_bytes) / kGiB);
  throw InputError(line);
}

class PathTracer {
 public:
  PathTracer(const Medium& medium, const Scene& scene, int channels, const ReferenceSettings& settings)
      : settings_(settings),
        start_(Clock::now()),
        scenery_(medium, scene),
        walk_(medium.topology()),
        sources_(sourcesOf(scenery_)),
        tally_(medium, channels, settings.want_flux),
        schedule_(medium.topology().activeVoxelCount(), sources_.size(), settings.samples) {
    if (settings_.samples == 0 && !(settings_.noise > 0) && !(settings_.seconds > 0))
      settings_.noise = kUsualNoise;
    for (const auto& source : sources_) unit_ += source->worth_of_all;
    if (!(unit_ > 0)) unit_ = 1;
    chooseWalkers();
  }

  ReferenceResult run() {
    ReferenceResult result;
    if (sources_.empty()) {
      result.warnings.push_back("no light reaches the volume: there is no lamp, and nothing in it glows");
    } else {
      tbb::filter<void, Batch*> draw(tbb::filter_mode::serial_in_order, [this](tbb::flow_control& control) {
        Batch* batch = nextBatch();
        if (!batch) control.stop();
        return batch;
      });
      tbb::filter<Batch*, Batch*> trace(tbb::filter_mode::parallel, [this](Batch* batch) {
        this->trace(*batch);
        return batch;
      });
      tbb::filter<Batch*, void> merge(tbb::filter_mode::serial_in_order,
                                      [this](Batch* batch) { this->merge(*batch); });
      tbb::parallel_pipeline(batchesInFlight(), draw & trace & merge);
    }
    tally_.finish(unit_, result);
    result.seconds = seconds();
    return result;
  }

 private:
  struct Batch {
    uint64_t number = 0, paths = 0;
    bool complete = false;
    std::unique_ptr<BatchTally> tally;
  };

  ReferenceSettings settings_;
  Clock::time_point start_;
  Scenery scenery_;
  VoxelWalk walk_;
  std::vector<std::unique_ptr<Source>> sources_;
  Tally tally_;
  Schedule schedule_;
  double unit_ = 0;  // W: about what a path brings to the medium, on the average
  double walker_power_ = 1;
  uint64_t drawn_ = 0;
  std::atomic<bool> done_{false};
  std::mutex free_mutex_;  // of the next two
  std::vector<std::unique_ptr<Batch>> batches_;
  std::vector<Batch*> free_;
  std::mutex phase_mutex_;  // of the next two
  std::string phase_ = "paths";
  double fraction_ = 0;

  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  /// A trial batch, whose light is thrown away, tells the power that collides on a ray, and the work of rays
  /// and of walks. With r and w that work, and the variance of k walkers from a ray being a + b / k, the
  /// least variance for the work is at k = sqrt(b r / (a w)); b / a is measured (kWalkers^2).
  void chooseWalkers() {
    if (sources_.empty()) return;
    Batch trial;
    trial.paths = std::max<uint64_t>(kTrialPaths, sources_.size());
    trial.number = ~uint64_t(0);
    trial.tally = tally_.newBatch();
    trace(trial);
    const BatchTally& t = *trial.tally;
    const double collided = (t.energy.scattered_in + t.energy.emitted) / static_cast<double>(trial.paths);
    if (!(collided > 0) || t.walks == 0) return;
    const double ray = kRayVoxels + static_cast<double>(t.ray_voxels) / static_cast<double>(trial.paths);
    const double walk =
        static_cast<double>(t.walk_voxels + kCollisionVoxels * t.scatterings) / static_cast<double>(t.walks);
    walker_power_ = collided / std::clamp(kWalkers * std::sqrt(ray / walk), 1.0, 16.0);
  }

  /// One for each thread, and one more to draw while another is merged; fewer where memory is short. The
  /// result does not depend on it.
  size_t batchesInFlight() const {
    const size_t count = static_cast<size_t>(tbb::this_task_arena::max_concurrency()) + 1;
    if (settings_.max_bytes == 0) return count;
    const Topology& topology = scenery_.medium.topology();
    const double left = static_cast<double>(settings_.max_bytes) -
                        Tally::bytesOfSums(topology, tally_.channels(), tally_.wantsFlux());
    const double most = left / Tally::bytesPerBatch(topology, tally_.channels(), tally_.wantsFlux());
    return most < static_cast<double>(count) ? static_cast<size_t>(std::max(1.0, most)) : count;
  }

  Batch* nextBatch() {
    if (done_) return nullptr;
    const uint64_t paths = schedule_.next();
    if (paths == 0) return nullptr;
    Batch* batch = nullptr;
    {
      const std::lock_guard<std::mutex> lock(free_mutex_);
      if (free_.empty()) {
        batches_.push_back(std::make_unique<Batch>());
        batches_.back()->tally = tally_.newBatch();
        batch = batches_.back().get();
      } else {
        batch = free_.back();
        free_.pop_back();
      }
    }
    batch->number = drawn_++;
    batch->paths = paths;
    batch->complete = false;
    return batch;
  }

  /// Paths are shared out among the sources in fixed numbers; a source's average counts, whatever its share.
  void trace(Batch& batch) {
    tally_.clear(*batch.tally);
    bool stopped = false;
    const auto goes_on = [&] {
      stopped = stopped || !lookUp(batch);
      return !stopped;
    };
    const auto follower =
        makeFollower(scenery_, walk_, tally_.channels(), walker_power_, goes_on, *batch.tally);
    uint64_t path = 0, sources_left = sources_.size(), paths_left = batch.paths;
    for (const auto& source : sources_) {
      --sources_left;
      uint64_t n = static_cast<uint64_t>(std::llround(static_cast<double>(batch.paths) * source->share));
      n = sources_left == 0 ? paths_left
                            : std::clamp<uint64_t>(n, 1, std::max<uint64_t>(paths_left - sources_left, 1));
      paths_left -= std::min(n, paths_left);
      const SpreadPoints points(source->dimensions(), n);
      const double weight = static_cast<double>(batch.paths) / static_cast<double>(n) / unit_;
      for (uint64_t i = 0; i < n; ++i, ++path) {
        if (stopped || (path % kPathsBetweenLooks == 0 && !goes_on())) return;
        RandomStream random(settings_.seed, batch.number, path);
        double u[4];
        points.point(i, random, u);
        const PathStart start = source->start(u, random);
        if (start.kind == PathStart::Kind::kNothing) continue;
        follower->follow(start, start.power * weight, random);
      }
    }
    follower->finish();
    batch.complete = !stopped;
  }

  /// False where there is no more to do.
  bool lookUp(const Batch& batch) {
    if (done_) return false;
    if (settings_.seconds > 0 && batch.number >= kFewestBatches && seconds() > settings_.seconds)
      return false;
    if (settings_.progress) {
      std::string phase;
      double fraction;
      {
        const std::lock_guard<std::mutex> lock(phase_mutex_);
        phase = phase_;
        fraction = std::max(fraction_, settings_.seconds > 0 ? seconds() / settings_.seconds : 0);
      }
      settings_.progress(phase, std::min(1.0, fraction));
    }
    return true;
  }

  void merge(Batch& batch) {
    if (!batch.complete) done_ = true;
    if (!done_) {
      tally_.add(*batch.tally, batch.paths);
      const double noise = tally_.noise();
      if (settings_.noise > 0 && tally_.batches() >= kTrustedBatches && noise <= settings_.noise)
        done_ = true;
      const std::lock_guard<std::mutex> lock(phase_mutex_);
      if (tally_.batches() >= kFewestBatches) {
        char text[40];
        std::snprintf(text, sizeof text, "noise %.2g %%", 100 * noise);
        phase_ = text;
      }
      fraction_ = 0;
      if (settings_.samples > 0)
        fraction_ = static_cast<double>(tally_.paths()) / static_cast<double>(settings_.samples);
      if (settings_.noise > 0 && noise > 0)
        fraction_ = std::max(fraction_, std::min(1.0, settings_.noise * settings_.noise / (noise * noise)));
    }
    const std::lock_guard<std::mutex> lock(free_mutex_);
    free_.push_back(&batch);
  }
};

}  // namespace

ReferenceResult reference(const Medium& medium, const Scene& scene, const ReferenceSettings& settings) {
  const int channels = channelsOf(medium, scene);
  if (medium.topology().activeVoxelCount() > 0) {
    checkMemory(medium, channels, settings);
    return PathTracer(medium, scene, channels, settings).run();
  }
  ReferenceResult result;
  result.diffuse = result.direct = result.diffuse_se = Channels(channels);
  result.warnings.push_back("the density has no active voxels");
  return result;
}

}  // namespace vdb_diffuse
