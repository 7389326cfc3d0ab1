#include "blobs/fit.h"

#include <algorithm>
#include <numeric>
#include <queue>

namespace vdb_diffuse {
namespace {

/// Of the weights of the fit, what is even over the volume and not by density: thin places need blobs too.
constexpr double kEvenShare = 0.1;

/// Sums over cells: weight, weight times position, weight times square of the position.
struct Moments {
  double weight = 0, square = 0;
  Vec3d first{0, 0, 0};
  void add(double w, const Vec3d& p, double own_square) {
    weight += w;
    first += p * w;
    square += w * (p.lengthSqr() + own_square);
  }
  void operator+=(const Moments& o) {
    weight += o.weight;
    first += o.first;
    square += o.square;
  }
};

class Fit {
 public:
  Fit(const Cells& cells, const FitSettings& settings) : cells_(cells), settings_(settings) {
    const double mass = std::accumulate(cells.mass.begin(), cells.mass.end(), 0.0);
    const double volume = std::accumulate(cells.volume.begin(), cells.volume.end(), 0.0);
    const double even = mass > 0 ? kEvenShare * mass / volume : 1;
    for (size_t c = 0; c < cells.count(); ++c)
      weight_.push_back((mass > 0 ? (1 - kEvenShare) * cells.mass[c] : 0) + even * cells.volume[c]);
    // A cell is a cube, not a point; a blob is not smaller than it.
    const double w2 = cells.width * cells.width;
    cell_square_ = w2 * cells.stretch.lengthSqr() / 12;
    least_sigma_ = std::sqrt(cell_square_ / 3);
  }

  std::vector<Blob> run() {
    divide();
    for (int n = 0; n < settings_.iterations; ++n) {
      if (settings_.progress) settings_.progress("blobs", static_cast<double>(n) / settings_.iterations);
      iterate();
      if (n == settings_.iterations / 2) thinOut();
    }
    thinOut();
    for (Blob& blob : blobs_) blob.sigma *= settings_.overlap;
    return std::move(blobs_);
  }

 private:
  const Cells& cells_;
  const FitSettings& settings_;
  std::vector<double> weight_;  // by cell
  double cell_square_ = 0, least_sigma_ = 0;
  std::vector<Blob> blobs_;

  Blob blobOf(const Moments& m) const {
    Blob blob;
    blob.centre = m.first / m.weight;
    blob.mass = m.weight;
    const double variance = (m.square / m.weight - blob.centre.lengthSqr()) / 3;
    blob.sigma = std::max(least_sigma_, std::sqrt(std::max(0.0, variance)));
    return blob;
  }

  /// A part of the volume: a stretch of the list of cells.
  struct Part {
    size_t begin, end;
    double cost;  ///< sum of w r^2 about the mean
    int axis;     ///< of largest spread
    double mean;  ///< along it
    bool operator<(const Part& o) const { return cost < o.cost || (cost == o.cost && begin > o.begin); }
  };

  Part measured(const std::vector<size_t>& order, size_t begin, size_t end) const {
    double weight = 0;
    Vec3d first(0), square(0);
    // About a point nearby, or large coordinates would leave nothing of the spread.
    const Vec3d about = cells_.centre[order[begin]];
    for (size_t i = begin; i < end; ++i) {
      const double w = weight_[order[i]];
      const Vec3d p = cells_.centre[order[i]] - about;
      weight += w;
      first += p * w;
      square += p * p * w;
    }
    Part part{begin, end, 0, 0, 0};
    double widest = -1;
    for (int a = 0; a < 3; ++a) {
      const double spread = weight > 0 ? std::max(0.0, square[a] - first[a] * first[a] / weight) : 0;
      part.cost += spread;
      if (spread <= widest) continue;
      widest = spread;
      part.axis = a;
      part.mean = about[a] + (weight > 0 ? first[a] / weight : 0);
    }
    return part;
  }

  void divide() {
    std::vector<size_t> order(cells_.count());
    std::iota(order.begin(), order.end(), size_t{0});
    if (order.empty()) return;
    std::priority_queue<Part> parts;
    std::vector<Part> whole;  // that cannot be halved
    parts.push(measured(order, 0, order.size()));
    while (!parts.empty() && parts.size() + whole.size() < static_cast<size_t>(settings_.count)) {
      const Part part = parts.top();
      parts.pop();
      const auto middle =
          std::stable_partition(order.begin() + part.begin, order.begin() + part.end,
                                [&](size_t c) { return cells_.centre[c][part.axis] < part.mean; });
      const size_t at = static_cast<size_t>(middle - order.begin());
      if (at == part.begin || at == part.end) {
        whole.push_back(part);
        continue;
      }
      parts.push(measured(order, part.begin, at));
      parts.push(measured(order, at, part.end));
    }
    for (; !parts.empty(); parts.pop()) whole.push_back(parts.top());
    for (const Part& part : whole) {
      Moments m;
      for (size_t i = part.begin; i < part.end; ++i)
        m.add(weight_[order[i]], cells_.centre[order[i]], cell_square_);
      if (m.weight > 0) blobs_.push_back(blobOf(m));
    }
  }

  /// One step of expectation and maximisation.
  void iterate() {
    const std::vector<std::vector<int32_t>> lists = blobsByBlock(blobs_, cells_);
    std::vector<Moments> sums(blobs_.size());
    const size_t blocks = lists.size();
    constexpr size_t kAtOnce = 1024;  // blocks whose sums wait to be added in order
    for (size_t from = 0; from < blocks; from += kAtOnce) {
      const size_t count = std::min(kAtOnce, blocks - from);
      std::vector<std::vector<Moments>> parts(count);
      std::vector<std::vector<std::pair<int32_t, Moments>>> alone(count);
      forEachBlock(count, [&](size_t i) { share(from + i, lists[from + i], parts[i], alone[i]); });
      for (size_t i = 0; i < count; ++i) {
        for (size_t k = 0; k < parts[i].size(); ++k) sums[lists[from + i][k]] += parts[i][k];
        for (const auto& [blob, moments] : alone[i]) sums[blob] += moments;
      }
    }
    std::vector<Blob> next;
    for (const Moments& m : sums)
      if (m.weight > 0) next.push_back(blobOf(m));
    blobs_ = std::move(next);
  }

  /// Shares a block's cells out among the blobs that reach it; one out of reach of all goes to the nearest.
  void share(size_t block, const std::vector<int32_t>& list, std::vector<Moments>& sums,
             std::vector<std::pair<int32_t, Moments>>& alone) const {
    sums.resize(list.size());
    std::vector<double> part(list.size());
    for (size_t c = cells_.first[block]; c < cells_.first[block + 1]; ++c) {
      const Vec3d& p = cells_.centre[c];
      double total = 0;
      for (size_t k = 0; k < list.size(); ++k) {
        const Blob& blob = blobs_[list[k]];
        part[k] =
            blobPeak(blob) * blobKernel((p - blob.centre).lengthSqr() / (blob.sigma * blob.sigma)).value;
        total += part[k];
      }
      if (total > 0) {
        for (size_t k = 0; k < list.size(); ++k)
          if (part[k] > 0) sums[k].add(weight_[c] * part[k] / total, p, cell_square_);
      } else {
        Moments m;
        m.add(weight_[c], p, cell_square_);
        alone.emplace_back(nearestBlob(blobs_, p), m);
      }
    }
  }

  /// Of two blobs that are too close, only the heavier stays, with the mass of both.
  void thinOut() {
    std::vector<size_t> order(blobs_.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return blobs_[a].mass > blobs_[b].mass; });
    std::vector<Blob> kept;
    for (const size_t i : order) {
      const Blob& blob = blobs_[i];
      const auto close = std::find_if(kept.begin(), kept.end(), [&](const Blob& other) {
        const double least = kClosestBlobs * 0.5 * (blob.sigma + other.sigma);
        return (blob.centre - other.centre).lengthSqr() < least * least;
      });
      if (close == kept.end())
        kept.push_back(blob);
      else
        close->mass += blob.mass;
    }
    blobs_ = std::move(kept);
  }
};

}  // namespace

std::vector<Blob> fitBlobs(const Cells& cells, const FitSettings& settings) {
  return Fit(cells, settings).run();
}

std::vector<std::vector<int32_t>> blobsByBlock(const std::vector<Blob>& blobs, const Cells& cells) {
  std::vector<std::vector<int32_t>> lists(cells.corner.size());
  forEachBlock(lists.size(), [&](size_t b) {
    const Vec3d low = cells.corner[b] - 0.5 * cells.stretch;
    const Vec3d high = low + double(kBlockWidth) * cells.stretch;
    for (size_t i = 0; i < blobs.size(); ++i) {
      Vec3d nearest = blobs[i].centre;
      for (int a = 0; a < 3; ++a) nearest[a] = std::clamp(nearest[a], low[a], high[a]);
      const double reach = kBlobReach * blobs[i].sigma;
      if ((nearest - blobs[i].centre).lengthSqr() < reach * reach)
        lists[b].push_back(static_cast<int32_t>(i));
    }
  });
  return lists;
}

int32_t nearestBlob(const std::vector<Blob>& blobs, const Vec3d& p_frame) {
  int32_t best = 0;
  double least = HUGE_VAL;
  for (size_t i = 0; i < blobs.size(); ++i) {
    const double q = (p_frame - blobs[i].centre).lengthSqr() / (blobs[i].sigma * blobs[i].sigma);
    if (q >= least) continue;
    least = q;
    best = static_cast<int32_t>(i);
  }
  return best;
}

}  // namespace vdb_diffuse
