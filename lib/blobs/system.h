#pragma once

#include "blobs/basis.h"
#include "diffusion/equation.h"

namespace vdb_diffuse {

/// How the equation is tested. kGalerkin: in the mean over every psi_j. kCollocation: at the centres x_j, as
/// Stam (1995) section 4.2 has it.
enum class BlobForm { kGalerkin, kCollocation };

// The equation between blobs. Galerkin's is that of the resistor network (equation.h) for light in the span
// of the blobs, its sums over faces and voxels taken cell by cell with the gradient at the cell's centre:
//
//     A_ij = sum over cells of  sum_axes C_a d_a psi_i d_a psi_j  +  sink psi_i psi_j,     b_j = sum b psi_j
//
// with C_a the sum of the faces' conductances, and in `sink` what is absorbed and what leaves through open
// faces. It is symmetric and positive. As the psi add up to one, its rows add up to the energy balance.
//
// Collocation has   A_ji = -D lap psi_i - grad D . grad psi_i + (sigma_a rho + leak_j) psi_i   at x_j, with
// rho the sum of the blobs. An albedo field comes in as its mean about each blob, sum a_i psi_i at x_j. The
// paper says that blobs satisfy the boundary condition naturally. But a constant light satisfies all of its
// equations where nothing is absorbed: the boundary has to come in, and does as leak_j, the mean over psi_j
// of what leaves per volume. See Blobs.CollocationAsPrintedIsSingular.
struct BlobSystem {
  std::vector<size_t> first;  ///< by row its first entry; one more at the end
  std::vector<int32_t> column;
  std::vector<double> value;
  std::vector<double> volume;  ///< sum of psi_j over the voxels

  size_t size() const { return volume.size(); }
};

BlobSystem formBlobSystem(const std::vector<Blob>& blobs, const Cells& cells, const CellBasis& basis,
                          const Equation& equation, const Medium& medium, BlobForm form,
                          const Progress& progress = {});

}  // namespace vdb_diffuse
