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

/// psi and its gradient on the cells, of all the blobs that reach into a cell's block.
struct CellBasis {
  std::vector<std::vector<int32_t>> blobs;  ///< by block, ascending
  /// Entries stand block by block, in it cell by cell, and there in the order of the block's blobs; zero for
  /// a blob that does not reach the cell.
  std::vector<size_t> first;  ///< by block its first entry; one more at the end
  AlignedArray<float> value;
  std::array<AlignedArray<float>, 3> gradient;  ///< per mean voxel size

  /// Of the cell numbered `cell` within the block, its first entry.
  size_t at(size_t block, size_t cell) const { return first[block] + cell * blobs[block].size(); }
};

CellBasis basisOnCells(const std::vector<Blob>& blobs, const Cells& cells);

/// By blob j the sum of psi_j times a quantity of the cells.
std::vector<double> weighedByBlobs(const CellBasis& basis, const Cells& cells, size_t blob_count,
                                   const std::vector<double>& by_cell);

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
void evaluate(const std::vector<Blob>& blobs, const CellBasis& basis, const Cells& cells,
              const Topology& topology, const std::vector<double>& values, Field<T>& out);

}  // namespace vdb_diffuse
