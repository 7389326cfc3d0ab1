#include "grid/norms.h"

#include <tbb/parallel_sort.h>

#include <cmath>
#include <numeric>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

struct Cell {
  Coord at;
  double weight = 0;
  double a[3] = {0, 0, 0}, b[3] = {0, 0, 0}, variance[3] = {0, 0, 0};

  void operator+=(const Cell& o) {
    weight += o.weight;
    for (int c = 0; c < 3; ++c) {
      a[c] += o.a[c];
      b[c] += o.b[c];
      variance[c] += o.variance[c];
    }
  }
  /// From sums to means.
  void normalise() {
    if (!(weight > 0)) return;
    for (int c = 0; c < 3; ++c) {
      a[c] /= weight;
      b[c] /= weight;
      variance[c] /= weight * weight;
    }
  }
};

struct Deviation {
  float size, weight;
  bool operator<(const Deviation& o) const { return size != o.size ? size < o.size : weight < o.weight; }
};

/// A grid's values at the voxels of one block of another topology.
class BlockReader {
 public:
  BlockReader(const GridValues& grid, const Coord& origin)
      : grid_(grid), block_(grid.topology->find(origin)), last_(static_cast<int>(grid.channels.size()) - 1) {}
  double operator()(int voxel, int c) const {
    c = std::min(c, last_);
    if (block_ == kNoBlock || !grid_.topology->active(block_).isOn(voxel)) return grid_.background[c];
    return grid_.channels[c].block(block_)[voxel];
  }

 private:
  const GridValues& grid_;
  int32_t block_;
  int last_;
};

struct Grids {
  const GridValues &a, &b;
  const GridValues *standard_error, *weight;
  int channels;
};

Topology unionOf(const Topology& a, const Topology& b) {
  std::vector<Coord> origins;
  std::vector<BlockMask> active;
  for (size_t i = 0; i < a.blockCount(); ++i) {
    origins.push_back(a.origin(i));
    active.push_back(a.active(i));
    const int32_t j = b.find(a.origin(i));
    if (j != kNoBlock) active.back() |= b.active(j);
  }
  for (size_t j = 0; j < b.blockCount(); ++j) {
    if (a.find(b.origin(j)) != kNoBlock) continue;
    origins.push_back(b.origin(j));
    active.push_back(b.active(j));
  }
  return Topology(std::move(origins), std::move(active));
}

int floorDivide(int x, int n) {
  return x >= 0 ? x / n : -((-(x + 1)) / n) - 1;
}

/// The cells that a block of voxels meets, as weighted sums over its voxels.
std::vector<Cell> cellsOf(const Grids& grids, const Topology& where, size_t block, int width,
                          uint64_t& nonfinite) {
  const Coord origin = where.origin(block);
  Coord first, count;
  for (int a = 0; a < 3; ++a) {
    first[a] = floorDivide(origin[a], width);
    count[a] = floorDivide(origin[a] + kBlockWidth - 1, width) - first[a] + 1;
  }
  std::vector<Cell> cells(static_cast<size_t>(count[0]) * count[1] * count[2]);
  const BlockReader a(grids.a, origin), b(grids.b, origin);
  const BlockReader se(grids.standard_error ? *grids.standard_error : grids.b, origin);
  const BlockReader weight(grids.weight ? *grids.weight : grids.b, origin);
  for (auto voxel = where.active(block).beginOn(); voxel; ++voxel) {
    const int n = voxel.pos();
    const Coord p = origin + voxelLocal(n);
    Cell value;
    value.weight = grids.weight ? weight(n, 0) : 1;
    if (!std::isfinite(value.weight) || value.weight < 0)
      throw InputError("the weight at voxel (" + std::to_string(p[0]) + "," + std::to_string(p[1]) + "," +
                       std::to_string(p[2]) + ") is " + std::to_string(value.weight) +
                       "; weights are finite and not negative");
    bool finite = true;
    for (int c = 0; c < grids.channels; ++c) {
      const double error = grids.standard_error ? se(n, c) : 0;
      value.a[c] = value.weight * a(n, c);
      value.b[c] = value.weight * b(n, c);
      value.variance[c] = value.weight * value.weight * error * error;
      finite = finite && std::isfinite(a(n, c)) && std::isfinite(b(n, c)) && std::isfinite(error);
    }
    if (!finite) {
      ++nonfinite;
      continue;
    }
    const Coord k(floorDivide(p[0], width) - first[0], floorDivide(p[1], width) - first[1],
                  floorDivide(p[2], width) - first[2]);
    Cell& cell = cells[(static_cast<size_t>(k[0]) * count[1] + k[1]) * count[2] + k[2]];
    cell.at = Coord(width * (first[0] + k[0]), width * (first[1] + k[1]), width * (first[2] + k[2]));
    cell += value;
  }
  cells.erase(std::remove_if(cells.begin(), cells.end(), [](const Cell& c) { return !(c.weight > 0); }),
              cells.end());
  return cells;
}

struct Sums {
  double weight = 0, d = 0, dd = 0, abs_b = 0, bb = 0, variance = 0, largest = -1;
  Coord largest_at{0, 0, 0};
  uint64_t samples = 0, nonfinite = 0;

  void add(const Cell& cell, int channels) {
    for (int c = 0; c < channels; ++c) {
      const double difference = cell.a[c] - cell.b[c];
      weight += cell.weight;
      d += cell.weight * difference;
      dd += cell.weight * difference * difference;
      abs_b += cell.weight * std::abs(cell.b[c]);
      bb += cell.weight * cell.b[c] * cell.b[c];
      variance += cell.weight * cell.variance[c];
      ++samples;
      if (std::abs(difference) > largest) {
        largest = std::abs(difference);
        largest_at = cell.at;
      }
    }
  }
  Sums& operator+=(const Sums& o) {
    weight += o.weight;
    d += o.d;
    dd += o.dd;
    abs_b += o.abs_b;
    bb += o.bb;
    variance += o.variance;
    samples += o.samples;
    nonfinite += o.nonfinite;
    if (o.largest > largest) {
      largest = o.largest;
      largest_at = o.largest_at;
    }
    return *this;
  }
};

/// Sums over samples in a fixed order, each sample's error written to its own place.
Sums sumUp(const Grids& grids, const Topology& where, int width, std::vector<Deviation>& errors) {
  const auto note = [&](Sums& sums, Cell cell, Deviation* error) {
    cell.normalise();
    sums.add(cell, grids.channels);
    for (int c = 0; c < grids.channels; ++c)
      error[c] = {static_cast<float>(std::abs(cell.a[c] - cell.b[c])), static_cast<float>(cell.weight)};
  };
  const size_t blocks = where.blockCount();
  if (width == 1) {
    std::vector<size_t> first(blocks + 1, 0);
    for (size_t b = 0; b < blocks; ++b) first[b + 1] = first[b] + where.active(b).countOn() * grids.channels;
    errors.assign(first[blocks], Deviation{0, 0});
    return sumOverBlocks<Sums>(blocks, [&](size_t b) {
      Sums sums;
      Deviation* error = errors.data() + first[b];
      for (const Cell& cell : cellsOf(grids, where, b, 1, sums.nonfinite)) {
        note(sums, cell, error);
        error += grids.channels;
      }
      return sums;
    });
  }
  std::vector<std::vector<Cell>> of_block(blocks);
  Sums sums = sumOverBlocks<Sums>(blocks, [&](size_t b) {
    Sums s;
    of_block[b] = cellsOf(grids, where, b, width, s.nonfinite);
    return s;
  });
  std::vector<Cell> cells;
  for (const auto& some : of_block) cells.insert(cells.end(), some.begin(), some.end());
  std::stable_sort(cells.begin(), cells.end(), [](const Cell& x, const Cell& y) { return x.at < y.at; });
  errors.reserve(cells.size() * grids.channels);
  for (size_t i = 0; i < cells.size();) {
    Cell whole = cells[i];
    for (++i; i < cells.size() && cells[i].at == whole.at; ++i) whole += cells[i];
    errors.resize(errors.size() + grids.channels);
    note(sums, whole, errors.data() + errors.size() - grids.channels);
  }
  return sums;
}

/// The error that the given share of the weight does not exceed; `errors` in ascending order.
double percentile(const std::vector<Deviation>& errors, double total_weight, double share) {
  double weight = 0;
  for (const Deviation& error : errors) {
    weight += error.weight;
    if (weight >= share * total_weight) return error.size;
  }
  return errors.empty() ? 0 : errors.back().size;
}

/// Numerator over denominator; a grid that should be zero and is not has an infinite error.
double ratio(double numerator, double denominator) {
  if (denominator > 0) return numerator / denominator;
  return numerator == 0 ? 0 : std::copysign(INFINITY, numerator);
}

}  // namespace

Norms compareGrids(const GridValues& a, const GridValues& b, const GridValues* standard_error,
                   const GridValues* weight, int block) {
  const Grids grids{a, b, standard_error, weight,
                    static_cast<int>(std::max(a.channels.size(), b.channels.size()))};
  const Topology where = unionOf(*a.topology, *b.topology);
  if (!sameVoxels(a.transform, b.transform, where))
    throw InputError("the two grids' voxels do not lie in the same places; resample one onto the other");
  if (standard_error && !sameVoxels(standard_error->transform, b.transform, where))
    throw InputError("the standard error's voxels do not lie where its grid's do");
  if (weight && (weight->channels.size() != 1 || !sameVoxels(weight->transform, b.transform, where)))
    throw InputError("weights are one number per voxel, on the voxels of the grids compared");

  std::vector<Deviation> errors;
  const Sums sums = sumUp(grids, where, block, errors);
  Norms result;
  result.samples = sums.samples;
  result.nonfinite = sums.nonfinite;
  if (sums.samples == 0) return result;
  const double mean = sums.abs_b / sums.weight;
  result.mean = mean;
  result.noise = std::sqrt(ratio(sums.variance, sums.bb));
  const double square = ratio(sums.dd, sums.bb) - (sums.bb > 0 ? sums.variance / sums.bb : 0);
  result.rel_rms = std::sqrt(std::max(0.0, square));
  result.bias = ratio(sums.d, sums.abs_b);
  tbb::parallel_sort(errors.begin(), errors.end());
  double weights = 0;  // summed as in percentile(): the places kept for non-finite samples weigh nothing
  for (const Deviation& error : errors) weights += error.weight;
  result.p50 = ratio(percentile(errors, weights, 0.5), mean);
  result.p95 = ratio(percentile(errors, weights, 0.95), mean);
  result.p99 = ratio(percentile(errors, weights, 0.99), mean);
  result.max = ratio(sums.largest, mean);
  result.max_at = sums.largest_at;
  return result;
}

double heaviestColumn(const Topology& topology, const Field<float>& values, int axis) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  std::vector<size_t> order(topology.blockCount());
  std::iota(order.begin(), order.end(), size_t(0));
  const auto sameColumn = [&](size_t i, size_t j) {
    return topology.origin(i)[u] == topology.origin(j)[u] && topology.origin(i)[v] == topology.origin(j)[v];
  };
  std::stable_sort(order.begin(), order.end(), [&](size_t i, size_t j) {
    const Coord &p = topology.origin(i), &q = topology.origin(j);
    return p[u] != q[u] ? p[u] < q[u] : p[v] < q[v];
  });
  double heaviest = 0;
  for (size_t k = 0; k < order.size();) {
    std::array<double, 64> column{};
    const size_t first = order[k];
    for (; k < order.size() && sameColumn(first, order[k]); ++k) {
      const float* value = values.block(order[k]);
      for (int n = 0; n < kBlockVoxels; ++n) {
        const Coord local = voxelLocal(n);
        column[local[u] * 8 + local[v]] += value[n];
      }
    }
    for (const double sum : column) heaviest = std::max(heaviest, sum);
  }
  return heaviest;
}

}  // namespace vdb_diffuse
