#include "blobs/system.h"

#include <algorithm>
#include <atomic>

#include "grid/row.h"

namespace vdb_diffuse {
namespace {

/// A blob among those of a block.
struct InBlock {
  int32_t block, at;
};

/// By blob the blocks that it reaches into.
std::vector<std::vector<InBlock>> blocksOfBlobs(const CellBasis& basis, size_t blob_count) {
  std::vector<std::vector<InBlock>> reached(blob_count);
  for (size_t b = 0; b < basis.blobs.size(); ++b)
    for (size_t k = 0; k < basis.blobs[b].size(); ++k)
      reached[basis.blobs[b][k]].push_back({static_cast<int32_t>(b), static_cast<int32_t>(k)});
  return reached;
}

/// Sums over a cell's voxels of what its faces conduct along each axis, of the sink, and of what is absorbed.
struct CellSums {
  std::vector<Vec3d> conductance;
  std::vector<double> sink, absorbed;
};

/// What a block's voxels conduct to their neighbours above along an axis.
/// \param r, beyond  half the resistances of its voxels and of the next block's; null: there is none
VDB_DIFFUSE_KERNEL void conduct(const float* r, const float* beyond, int axis, float* g) {
  if (axis == 2) {
    for (int n = 0; n < kBlockVoxels; n += kBlockWidth) {
      for (int z = 0; z < kBlockWidth - 1; ++z) g[n + z] = 1 / (r[n + z] + r[n + z + 1]);
      g[n + 7] = beyond ? 1 / (r[n + 7] + beyond[n]) : 0;
    }
    return;
  }
  const int stride = axis == 0 ? 64 : 8;
  for (int n = 0; n < kBlockVoxels; n += kBlockWidth) {
    const bool last = n / stride % kBlockWidth == 7;
    if (last && !beyond)
      storeRow(g + n, Row{});
    else
      storeRow(g + n, 1 / (loadRow(r + n) + loadRow(last ? beyond + n - 7 * stride : r + n + stride)));
  }
}

CellSums sumsOf(const Equation& e, const Medium& medium, const Cells& cells, BlobForm form) {
  const Operator& A = *e.A;
  const Topology& topology = *A.topology;
  CellSums sums;
  sums.conductance.assign(cells.count(), Vec3d(0));
  sums.sink.assign(cells.count(), 0.0);
  forEachBlock(topology.blockCount(), [&](size_t b) {
    const float* sink = A.sink.block(b);
    alignas(64) float g[3][kBlockVoxels];
    for (int axis = 0; axis < 3; ++axis) {
      const int32_t across = topology.neighbours(b)[2 * axis + 1];
      conduct(A.half_resistance.block(b), across == kNoBlock ? nullptr : A.half_resistance.block(across),
              axis, g[axis]);
    }
    const auto cuts = A.cuts.find(static_cast<int32_t>(b));
    if (cuts != A.cuts.end())
      for (int axis = 0; axis < 3; ++axis)
        for (auto it = cuts->second.cut[2 * axis + 1].beginOn(); it; ++it) g[axis][it.pos()] = 0;
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      const int32_t c = cells.of(b, n);
      sums.conductance[c] += Vec3d(g[0][n], g[1][n], g[2][n]);
      sums.sink[c] += sink[n];
    }
  });
  if (form == BlobForm::kCollocation)
    sums.absorbed = sumOverCells(cells, topology, [&](size_t b, int n) {
      const float rho = medium.density.values.block(b)[n];
      const ChannelOptics there = e.optics.at(b, n);
      return there.sigma_a * e.h * rho / e.profile(there, rho).a;
    });
  return sums;
}

/// What the albedo field takes of the scattering about each blob, 0..1; empty without one.
std::vector<double> lostAbout(const CellBasis& basis, size_t blob_count, const Equation& e,
                              const Medium& medium, const Cells& cells) {
  if (!e.optics.albedo_field) return {};
  const std::vector<double> lost = sumOverCells(cells, medium.topology(), [&](size_t b, int n) {
    return (1 - double{e.optics.albedo_field->block(b)[n]}) * medium.density.values.block(b)[n];
  });
  std::vector<double> about = weighedByBlobs(basis, cells, blob_count, lost);
  const std::vector<double> mass =
      weighedByBlobs(basis, cells, blob_count, {cells.mass.begin(), cells.mass.end()});
  for (size_t j = 0; j < blob_count; ++j)
    if (mass[j] > 0) about[j] /= mass[j];
  return about;
}

/// A row that is filled in any order and read out in the order of its columns.
class RowSum {
 public:
  explicit RowSum(size_t size) : sum_(size, 0.0), used_(size, 0) {}
  void add(int32_t column, double value) {
    if (!used_[column]) {
      used_[column] = 1;
      columns_.push_back(column);
    }
    sum_[column] += value;
  }
  void take(std::vector<int32_t>& column, std::vector<double>& value) {
    std::sort(columns_.begin(), columns_.end());
    for (const int32_t i : columns_) {
      column.push_back(i);
      value.push_back(sum_[i]);
      sum_[i] = 0;
      used_[i] = 0;
    }
    columns_.clear();
  }

 private:
  std::vector<double> sum_;
  std::vector<char> used_;
  std::vector<int32_t> columns_;
};

/// What a cell couples a blob with the others by: what it conducts times the blob's gradient, and the sink.
struct Coupling {
  double pull[3], sink;
};

/// Adds the products of a blob's coupling in a cell with the first `count` of the cell's entries from `e` on.
VDB_DIFFUSE_KERNEL void addProducts(const Coupling& own, const CellBasis& basis, size_t e, size_t count,
                                    double* sum) {
  const float *x = &basis.gradient[0][e], *y = &basis.gradient[1][e], *z = &basis.gradient[2][e],
              *value = &basis.value[e];
  const double gx = own.pull[0], gy = own.pull[1], gz = own.pull[2], sink = own.sink;
  for (size_t k = 0; k < count; ++k) sum[k] += gx * x[k] + gy * y[k] + gz * z[k] + sink * value[k];
}

}  // namespace

BlobSystem formBlobSystem(const std::vector<Blob>& blobs, const Cells& cells, const CellBasis& basis,
                          const Equation& equation, const Medium& medium, BlobForm form,
                          const Progress& progress) {
  const CellSums sums = sumsOf(equation, medium, cells, form);
  const size_t n = blobs.size();
  const std::vector<std::vector<InBlock>> reached = blocksOfBlobs(basis, n);
  const std::vector<double> lost = lostAbout(basis, n, equation, medium, cells);
  BlobSystem system;
  system.volume = weighedByBlobs(basis, cells, n, {cells.volume.begin(), cells.volume.end()});
  std::vector<double> leaks;
  if (form == BlobForm::kCollocation) {
    leaks = sums.sink;
    for (size_t c = 0; c < leaks.size(); ++c) leaks[c] -= sums.absorbed[c];
    leaks = weighedByBlobs(basis, cells, n, leaks);
  }
  std::vector<std::vector<int32_t>> columns(n);
  std::vector<std::vector<double>> values(n);

  const auto galerkinRow = [&](size_t j, RowSum& row) {
    std::vector<double> products;
    for (const auto& [block, at] : reached[j]) {
      products.assign(at + 1, 0.0);
      const size_t first = cells.first[block];
      for (size_t c = first; c < cells.first[block + 1]; ++c) {
        const size_t e = basis.at(block, c - first), own = e + at;
        if (basis.value[own] == 0) continue;
        Coupling coupling;
        for (int axis = 0; axis < 3; ++axis)
          coupling.pull[axis] = sums.conductance[c][axis] * basis.gradient[axis][own];
        coupling.sink = sums.sink[c] * basis.value[own];
        addProducts(coupling, basis, e, at + 1, products.data());
      }
      for (int32_t k = 0; k <= at; ++k) row.add(basis.blobs[block][k], products[k]);
    }
  };
  const auto collocationRow = [&](size_t j, RowSum& row) {
    const double leak = leaks[j] / system.volume[j];
    const BasisAt at = basisAt(blobs, blobs[j].centre);
    double lost_here = 0;
    Vec3d lost_gradient(0);
    for (size_t k = 0; k < at.blob.size() && !lost.empty(); ++k) {
      lost_here += lost[at.blob[k]] * at.value[k];
      lost_gradient += lost[at.blob[k]] * at.gradient[k];
    }
    const ChannelOptics there = lost.empty() ? equation.optics : equation.optics.where(1 - lost_here);
    const double depth = there.sigma_tr * equation.h * at.density;
    const bool bounded = depth < equation.least_depth;
    const double D = 0.5 / (equation.resistance_per_depth * std::max(depth, equation.least_depth));
    Vec3d dD = bounded ? Vec3d(0) : at.density_gradient * (-D / at.density);
    if (!lost.empty() && !bounded)  // sigma_tr grows by g sigma_s of what is lost
      dD -= lost_gradient * (D * there.true_g * equation.optics.true_sigma_s / there.sigma_tr);
    const double sink = there.sigma_a * equation.h * at.density + leak;
    for (size_t k = 0; k < at.blob.size(); ++k)
      row.add(at.blob[k], sink * at.value[k] - D * at.laplacian[k] - dD.dot(at.gradient[k]));
  };

  std::atomic<size_t> done{0};
  tbb::parallel_for(tbb::blocked_range<size_t>(0, n, 8), [&](const auto& range) {
    RowSum row(n);
    for (size_t j = range.begin(); j != range.end(); ++j) {
      form == BlobForm::kGalerkin ? galerkinRow(j, row) : collocationRow(j, row);
      row.take(columns[j], values[j]);
      const size_t rows = ++done;
      if (progress && rows % 16 == 0) progress("blob system", static_cast<double>(rows) / n);
    }
  });
  if (form == BlobForm::kGalerkin) {  // the other half
    for (size_t j = 0; j < n; ++j)
      for (size_t k = 0; columns[j][k] != static_cast<int32_t>(j); ++k) {
        columns[columns[j][k]].push_back(static_cast<int32_t>(j));
        values[columns[j][k]].push_back(values[j][k]);
      }
  }
  system.first.push_back(0);
  for (size_t j = 0; j < n; ++j) {
    system.column.insert(system.column.end(), columns[j].begin(), columns[j].end());
    system.value.insert(system.value.end(), values[j].begin(), values[j].end());
    system.first.push_back(system.column.size());
  }
  return system;
}

}  // namespace vdb_diffuse
