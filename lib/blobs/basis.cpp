#include "blobs/basis.h"

#include <algorithm>

#include "grid/row.h"

namespace vdb_diffuse {
namespace {

/// What a block's rows gather: the sum of the weights of all blobs, and that times their values.
struct alignas(64) RowSums {
  float weight[kBlockVoxels], weighted[kBlockVoxels];
};

/// A blob over a block, factor by factor: the Gaussian is a product over the axes.
struct alignas(32) BlobRows {
  float e[3][kBlockWidth];  ///< exp(-q/2) along each axis; the peak is in the first
  float q[3][kBlockWidth];  ///< over reach^2
  float value;
};

VDB_DIFFUSE_KERNEL
void addRows(const BlobRows& blob, RowSums& sums) {
  const Row ez = loadRow(blob.e[2]), qz = loadRow(blob.q[2]);
  const Row zero{};
  for (int x = 0; x < kBlockWidth; ++x)
    for (int y = 0; y < kBlockWidth; ++y) {
      const float across = blob.q[0][x] + blob.q[1][y];
      if (across >= 1) continue;
      const Row s = across + qz;
      const Row t = 1 - s * s;
      const Row within = t > zero ? t : zero;
      const Row w = (blob.e[0][x] * blob.e[1][y]) * ez * within * within;
      const int row = 64 * x + 8 * y;
      storeRow(sums.weight + row, loadRow(sums.weight + row) + w);
      storeRow(sums.weighted + row, loadRow(sums.weighted + row) + blob.value * w);
    }
}

/// Sums and the two derivatives of all blobs at a point.
struct Sums {
  double w = 0, laplacian = 0;
  Vec3d gradient{0, 0, 0};
};

Sums weightAt(const Blob& blob, const Vec3d& p) {
  const Vec3d d = p - blob.centre;
  const double s2 = blob.sigma * blob.sigma, q = d.lengthSqr() / s2, peak = blobPeak(blob);
  const BlobKernel G = blobKernel(q);
  return {peak * G.value, peak * (4 * q * G.curvature + 6 * G.slope) / s2, d * (2 * peak * G.slope / s2)};
}

}  // namespace

CellBasis basisOnCells(const std::vector<Blob>& blobs, const Cells& cells) {
  CellBasis basis;
  basis.blobs = blobsByBlock(blobs, cells);
  const size_t blocks = basis.blobs.size();
  std::vector<int32_t> alone(cells.count(), -1);  // by cell that no blob reaches, the one nearest to it
  forEachBlock(blocks, [&](size_t b) {
    std::vector<int32_t>& list = basis.blobs[b];
    for (size_t c = cells.first[b]; c < cells.first[b + 1]; ++c) {
      const Vec3d& p = cells.centre[c];
      if (std::any_of(list.begin(), list.end(), [&](int32_t i) { return weightAt(blobs[i], p).w > 0; }))
        continue;
      alone[c] = nearestBlob(blobs, p);
      const auto place = std::lower_bound(list.begin(), list.end(), alone[c]);
      if (place == list.end() || *place != alone[c]) list.insert(place, alone[c]);
    }
  });
  basis.first.push_back(0);
  for (size_t b = 0; b < blocks; ++b)
    basis.first.push_back(basis.first[b] + basis.blobs[b].size() * (cells.first[b + 1] - cells.first[b]));
  basis.value = alignedArray<float>(basis.first.back());
  for (AlignedArray<float>& component : basis.gradient) component = alignedArray<float>(basis.first.back());
  forEachBlock(blocks, [&](size_t b) {
    const std::vector<int32_t>& list = basis.blobs[b];
    std::vector<Sums> weights(list.size());
    size_t e = basis.first[b];
    for (size_t c = cells.first[b]; c < cells.first[b + 1]; ++c) {
      Sums all;
      for (size_t k = 0; k < list.size(); ++k) {
        weights[k] = weightAt(blobs[list[k]], cells.centre[c]);
        all.w += weights[k].w;
        all.gradient += weights[k].gradient;
      }
      for (size_t k = 0; k < list.size(); ++k, ++e) {
        double psi = alone[c] == list[k];
        Vec3d gradient(0);
        if (weights[k].w > 0) {
          psi = weights[k].w / all.w;
          gradient = (weights[k].gradient - all.gradient * psi) / all.w;
        }
        basis.value[e] = static_cast<float>(psi);
        for (int axis = 0; axis < 3; ++axis) basis.gradient[axis][e] = static_cast<float>(gradient[axis]);
      }
    }
  });
  return basis;
}

std::vector<double> weighedByBlobs(const CellBasis& basis, const Cells& cells, size_t blob_count,
                                   const std::vector<double>& by_cell) {
  std::vector<std::vector<double>> parts(basis.blobs.size());
  forEachBlock(parts.size(), [&](size_t b) {
    std::vector<double>& part = parts[b];
    part.assign(basis.blobs[b].size(), 0.0);
    const float* value = basis.value.get() + basis.first[b];
    for (size_t c = cells.first[b]; c < cells.first[b + 1]; ++c)
      for (double& sum : part) sum += by_cell[c] * *value++;
  });
  std::vector<double> sums(blob_count, 0.0);
  for (size_t b = 0; b < parts.size(); ++b)
    for (size_t k = 0; k < parts[b].size(); ++k) sums[basis.blobs[b][k]] += parts[b][k];
  return sums;
}

BasisAt basisAt(const std::vector<Blob>& blobs, const Vec3d& p_frame) {
  BasisAt basis;
  Sums all;
  std::vector<Sums> weights;
  for (size_t i = 0; i < blobs.size(); ++i) {
    const Sums w = weightAt(blobs[i], p_frame);
    if (w.w <= 0) continue;
    basis.blob.push_back(static_cast<int32_t>(i));
    weights.push_back(w);
    all.w += w.w;
    all.gradient += w.gradient;
    all.laplacian += w.laplacian;
  }
  for (const Sums& w : weights) {
    const double psi = w.w / all.w;
    const Vec3d gradient = (w.gradient - all.gradient * psi) / all.w;
    basis.value.push_back(psi);
    basis.gradient.push_back(gradient);
    basis.laplacian.push_back((w.laplacian - 2 * gradient.dot(all.gradient) - psi * all.laplacian) / all.w);
  }
  basis.density = all.w / kBlobIntegral;
  basis.density_gradient = all.gradient / kBlobIntegral;
  return basis;
}

template <typename T>
void evaluate(const std::vector<Blob>& blobs, const CellBasis& basis, const Cells& cells,
              const Topology& topology, const std::vector<double>& values, Field<T>& out) {
  forEachBlock(topology.blockCount(), [&](size_t b) {
    RowSums sums{};
    for (const int32_t i : basis.blobs[b]) {
      const Blob& blob = blobs[i];
      BlobRows rows;
      rows.value = static_cast<float>(values[i]);
      for (int a = 0; a < 3; ++a)
        for (int n = 0; n < kBlockWidth; ++n) {
          const double u = (cells.corner[b][a] + n * cells.stretch[a] - blob.centre[a]) / blob.sigma;
          rows.e[a][n] = static_cast<float>(std::exp(-0.5 * u * u) * (a == 0 ? blobPeak(blob) : 1));
          rows.q[a][n] = static_cast<float>(u * u / (kBlobReach * kBlobReach));
        }
      addRows(rows, sums);
    }
    T* to = out.block(b);
    std::fill_n(to, kBlockVoxels, T(0));
    for (auto it = topology.active(b).beginOn(); it; ++it) {
      const int n = static_cast<int>(it.pos());
      to[n] = static_cast<T>(
          sums.weight[n] > 0
              ? sums.weighted[n] / sums.weight[n]
              : values[nearestBlob(blobs, cells.corner[b] + voxelLocal(n).asVec3d() * cells.stretch)]);
    }
  });
}

template void evaluate(const std::vector<Blob>&, const CellBasis&, const Cells&, const Topology&,
                       const std::vector<double>&, Field<float>&);
template void evaluate(const std::vector<Blob>&, const CellBasis&, const Cells&, const Topology&,
                       const std::vector<double>&, Field<double>&);

}  // namespace vdb_diffuse
