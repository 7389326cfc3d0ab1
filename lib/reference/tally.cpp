#include "reference/tally.h"

#include <tbb/task_arena.h>

#include <cmath>

namespace vdb_diffuse {
namespace {

struct Spread {
  double variance = 0, square = 0;
  Spread& operator+=(const Spread& o) {
    variance += o.variance;
    square += o.square;
    return *this;
  }
};

void addScaled(ReferenceEnergy& sum, const ReferenceEnergy& e, double factor) {
  sum.scattered_in += e.scattered_in * factor;
  sum.emitted += e.emitted * factor;
  sum.absorbed += e.absorbed * factor;
  sum.escaped += e.escaped * factor;
  sum.lost += e.lost * factor;
}

}  // namespace

void BatchTally::clear() {
  std::fill(diffuse.begin(), diffuse.end(), 0.0f);
  std::fill(direct.begin(), direct.end(), 0.0f);
  std::fill(flux.begin(), flux.end(), 0.0f);
  energy = {};
  scatterings = given_up = 0;
}

Tally::Tally(const Medium& medium, int channels, bool flux) : medium_(medium), channels_(channels) {
  const size_t voxels = medium.topology().blockCount() * kBlockVoxels;
  diffuse_.resize(voxels * channels);
  square_.resize(voxels * channels);
  direct_.resize(voxels * channels);
  if (flux) flux_.resize(voxels * 3);
}

std::unique_ptr<BatchTally> Tally::emptyBatch() const {
  auto batch = std::make_unique<BatchTally>();
  batch->diffuse.resize(diffuse_.size());
  batch->direct.resize(direct_.size());
  batch->flux.resize(flux_.size());
  return batch;
}

double Tally::bytesPerBatch(const Topology& topology, int channels, bool flux) {
  return sizeof(float) * (2.0 * channels + (flux ? 3 : 0)) * kBlockVoxels * topology.blockCount();
}

double Tally::bytesOfSums(const Topology& topology, int channels, bool flux) {
  // and as floats the result: three kinds of channels, the flux
  return (sizeof(double) + sizeof(float)) * (3.0 * channels + (flux ? 3 : 0)) * kBlockVoxels *
         topology.blockCount();
}

void Tally::add(const BatchTally& batch, uint64_t n) {
  paths_ += n;
  ++batches_;
  scatterings_ += batch.scatterings;
  given_up_ += batch.given_up;
  addScaled(energy_, batch.energy, 1);
  const Topology& topology = medium_.topology();
  const double inverse = 1 / static_cast<double>(n), paths = static_cast<double>(paths_);
  const double to_variance = batches_ > 1 ? 1 / (paths * static_cast<double>(batches_ - 1)) : 0;
  Spread spread;
  // Isolated, so that a thread that waits here does not take up another batch meanwhile.
  tbb::this_task_arena::isolate([&] {
    spread = sumOverBlocks<Spread>(topology.blockCount(), [&](size_t b) {
      Spread sum;
      const size_t first = b * kBlockVoxels;
      for (auto it = topology.active(b).beginOn(); it; ++it) {
        const size_t voxel = first + it.pos();
        for (size_t i = voxel * channels_; i < (voxel + 1) * channels_; ++i) {
          const double x = batch.diffuse[i];
          diffuse_[i] += x;
          square_[i] += x * x * inverse;
          direct_[i] += batch.direct[i];
          const double mean = diffuse_[i] / paths;
          sum.variance += std::max(0.0, square_[i] - diffuse_[i] * mean) * to_variance;
          sum.square += mean * mean;
        }
        if (flux_.empty()) continue;
        for (size_t i = voxel * 3; i < (voxel + 1) * 3; ++i) flux_[i] += batch.flux[i];
      }
      return sum;
    });
  });
  noise_ = spread.square > 0 ? std::sqrt(spread.variance / spread.square) : 0;
}

void Tally::finish(double unit, ReferenceResult& result) {
  const Topology& topology = medium_.topology();
  const Transform& transform = medium_.transform();
  result.samples = paths_;
  result.batches = batches_;
  result.scatterings = scatterings_;
  result.noise = noise_;
  const double paths = std::max<double>(1, static_cast<double>(paths_));
  result.energy = {};
  addScaled(result.energy, energy_, unit / paths);
  const double per_voxel = unit * transform.meanVoxelSize() / (4 * M_PI * transform.voxelVolume() * paths);
  const double degrees = batches_ > 1 ? static_cast<double>(batches_ - 1) : 1;
  for (int c = 0; c < channels_; ++c) {
    result.diffuse.emplace_back(topology);
    result.direct.emplace_back(topology);
    result.diffuse_se.emplace_back(topology);
  }
  Vec3d axis[3];
  for (int a = 0; a < 3; ++a) axis[a] = transform.axis(a) / transform.axis(a).length();
  for (auto& component : result.flux) component = flux_.empty() ? Field<float>() : Field<float>(topology);
  forEachBlock(topology.blockCount(), [&](size_t b) {
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const size_t voxel = b * kBlockVoxels + it.pos();
      for (int c = 0; c < channels_; ++c) {
        const size_t i = voxel * channels_ + c;
        const double variance = std::max(0.0, square_[i] - diffuse_[i] * diffuse_[i] / paths) / degrees;
        result.diffuse[c][voxel] = static_cast<float>(diffuse_[i] * per_voxel);
        result.direct[c][voxel] = static_cast<float>(direct_[i] * per_voxel);
        result.diffuse_se[c][voxel] = static_cast<float>(std::sqrt(variance * paths) * per_voxel);
      }
      if (flux_.empty()) continue;
      Vec3d flux(0);
      for (int a = 0; a < 3; ++a) flux += axis[a] * (flux_[voxel * 3 + a] * 4 * M_PI * per_voxel);
      for (int a = 0; a < 3; ++a) result.flux[a][voxel] = static_cast<float>(flux[a]);
    }
  });
  if (given_up_ > 0)
    result.warnings.push_back(std::to_string(given_up_) + " paths were given up after " +
                              std::to_string(kMostScatterings) + " scatterings; " +
                              std::to_string(result.energy.lost) + " W went with them");
  diffuse_ = square_ = direct_ = flux_ = {};
}

}  // namespace vdb_diffuse
