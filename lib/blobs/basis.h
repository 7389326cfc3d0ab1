#pragma once

#include "blobs/fit.h"

namespace vdb_diffuse {

// The field of the blobs, Stam (1995) section 4.2:
//
//     I(x) = sum_i I_i psi_i(x),     psi_i = m_i G(x - x_i) / rho(x),     rho = sum_k m_k G(x - x_k)
//
// The paper divides by the density, which there is the sum of the blobs. A fitted sum is not quite the
// density, and it is the sum that we divide by: then the psi_i add up to one everywhere, an even light is an
// even light, and what one blob loses others gain. Where no blob reaches, the one nearest in sigmas is alone.

/// psi and its gradient of the blobs that reach a cell, listed cell by cell.
struct CellBasis {
  std::vector<size_t> first;  ///< by cell its first entry; one more at the end
  AlignedArray<int32_t> blob;
  AlignedArray<float> value;
  std::array<AlignedArray<float>, 3> gradient;  ///< per mean voxel size

  size_t entryCount() const { return first.back(); }
};

CellBasis basisOnCells(const std::vector<Blob>& blobs, const Cells& cells);

/// psi, its gradient and its Laplacian at a point.
struct BasisAt {
  std::vector<int32_t> blob;
  std::vector<double> value, laplacian;
  std::vector<Vec3d> gradient;
  double density = 0;  ///< sum of the blobs, per voxel
  Vec3d density_gradient{0, 0, 0};
};

BasisAt basisAt(const std::vector<Blob>& blobs, const Vec3d& p_frame);

/// sum_i values_i psi_i in every active voxel, zero in the others.
template <typename T>
void evaluate(const std::vector<Blob>& blobs, const Cells& cells, const Topology& topology,
              const std::vector<double>& values, Field<T>& out);

}  // namespace vdb_diffuse
