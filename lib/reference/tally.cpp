#include "reference/tally.h"

#include <tbb/task_arena.h>

#include <array>
#include <cmath>

#include "reference/voxel_walk.h"

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

/// The cells of a block that a voxel lies in: 64 of 2^3 voxels, 8 of 4^3 and the block.
std::array<int, 3> cellsOf(size_t voxel) {
  const Coord p = voxelLocal(static_cast<int>(voxel));
  return {(p[0] >> 1) << 4 | (p[1] >> 1) << 2 | p[2] >> 1,
          64 + ((p[0] >> 2) << 2 | (p[1] >> 2) << 1 | p[2] >> 2), 72};
}

size_t recordOf(size_t block, size_t voxel) {
  const Coord local = voxelLocal(static_cast<int>(voxel));
  return block * kBlockVoxels + recordOffset(local[0], local[1], local[2]);
}

}  // namespace

Tally::Tally(const Medium& medium, int channels, bool flux) : medium_(medium), channels_(channels) {
  const size_t voxels = medium.topology().blockCount() * kBlockVoxels;
  diffuse_.resize(voxels * channels);
  square_.resize(voxels * channels);
  direct_.resize(voxels * channels);
  if (flux) flux_.resize(voxels * 3);
  cells_.resize(medium.topology().blockCount() * kCells * channels);
  cell_squares_.resize(cells_.size());
}

std::unique_ptr<BatchTally> Tally::newBatch() const {
  const size_t voxels = medium_.topology().blockCount() * kBlockVoxels;
  auto batch = std::make_unique<BatchTally>();
  batch->records.resize(voxels * (1 + channels_));
  batch->direct.resize(voxels * channels_);
  batch->flux.resize(flux_.size());
  for (size_t b = 0; b < medium_.topology().blockCount(); ++b)
    for (int n = 0; n < kBlockVoxels; ++n)
      batch->records[recordOf(b, n) * (1 + channels_)] = medium_.density.values.block(b)[n];
  return batch;
}

void Tally::clear(BatchTally& batch) const {
  const size_t stride = 1 + channels_;
  for (size_t first = 0; first < batch.records.size(); first += stride)
    std::fill_n(batch.records.begin() + first + 1, channels_, 0.0f);
  std::fill(batch.direct.begin(), batch.direct.end(), 0.0f);
  std::fill(batch.flux.begin(), batch.flux.end(), 0.0f);
  batch.energy = {};
  batch.scatterings = batch.given_up = batch.ray_voxels = batch.walk_voxels = batch.walks = 0;
}

double Tally::bytesPerBatch(const Topology& topology, int channels, bool flux) {
  return sizeof(float) * (1 + 2.0 * channels + (flux ? 3 : 0)) * kBlockVoxels * topology.blockCount();
}

double Tally::bytesOfSums(const Topology& topology, int channels, bool flux) {
  // and as floats the result: three kinds of channels, the flux
  return 2 * sizeof(double) * static_cast<double>(kCells) * channels * topology.blockCount() +
         (sizeof(double) + sizeof(float)) * (3.0 * channels + (flux ? 3 : 0)) * kBlockVoxels *
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
      double cell[3 * kCells] = {};
      for (auto it = topology.active(b).beginOn(); it; ++it) {
        const size_t voxel = b * kBlockVoxels + it.pos(), record = recordOf(b, it.pos());
        const std::array<int, 3> in = cellsOf(it.pos());
        for (int c = 0; c < channels_; ++c) {
          const size_t i = voxel * channels_ + c;
          const double x = batch.records[record * (1 + channels_) + 1 + c];
          for (const int n : in) cell[n * channels_ + c] += x;
          diffuse_[i] += x;
          square_[i] += x * x * inverse;
          direct_[i] += batch.direct[record * channels_ + c];
          const double mean = diffuse_[i] / paths;
          sum.variance += std::max(0.0, square_[i] - diffuse_[i] * mean) * to_variance;
          sum.square += mean * mean;
        }
        if (flux_.empty()) continue;
        for (int a = 0; a < 3; ++a) flux_[voxel * 3 + a] += batch.flux[record * 3 + a];
      }
      for (int n = 0; n < kCells * channels_; ++n) {
        cells_[b * kCells * channels_ + n] += cell[n];
        cell_squares_[b * kCells * channels_ + n] += cell[n] * cell[n] * inverse;
      }
      return sum;
    });
  });
  noise_ = spread.square > 0 ? std::sqrt(spread.variance / spread.square) : 0;
}

/// A cell of k voxels weighs k, as `compare --block` does: k times the variance of its mean is its sum's
/// variance over k, which were the sum of the voxels' if they were independent.
void Tally::findCorrelation(ReferenceResult& result) const {
  if (batches_ < 2) return;
  const Topology& topology = medium_.topology();
  const double paths = static_cast<double>(paths_);
  double together[3] = {}, alone[3] = {};
  for (size_t b = 0; b < topology.blockCount(); ++b) {
    int voxels[kCells] = {};
    double variance[3 * kCells] = {};  // of independent voxels
    for (auto it = topology.active(b).beginOn(); it; ++it)
      for (const int n : cellsOf(it.pos())) {
        ++voxels[n];
        for (int c = 0; c < channels_; ++c) {
          const size_t i = (b * kBlockVoxels + it.pos()) * channels_ + c;
          variance[n * channels_ + c] += std::max(0.0, square_[i] - diffuse_[i] * diffuse_[i] / paths);
        }
      }
    for (int n = 0; n < kCells * channels_; ++n) {
      const int k = voxels[n / channels_], width = n / channels_ < 64 ? 0 : n / channels_ < 72 ? 1 : 2;
      if (k == 0) continue;
      const size_t i = b * kCells * channels_ + n;
      together[width] += std::max(0.0, cell_squares_[i] - cells_[i] * cells_[i] / paths) / k;
      alone[width] += variance[n] / k;
    }
  }
  for (int w = 0; w < 3; ++w)
    if (alone[w] > 0) result.correlation[w] = std::sqrt(together[w] / alone[w]);
}

void Tally::finish(double unit, ReferenceResult& result) {
  const Topology& topology = medium_.topology();
  const Transform& transform = medium_.transform();
  result.samples = paths_;
  result.batches = batches_;
  result.scatterings = scatterings_;
  result.noise = noise_;
  findCorrelation(result);
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
  diffuse_ = square_ = direct_ = flux_ = cells_ = cell_squares_ = {};
}

}  // namespace vdb_diffuse
