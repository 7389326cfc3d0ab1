#pragma once

#include <cstdint>

#include "plane/plane_equation.h"

namespace vdb_diffuse {

/// A Gaussian blob of Stam (1995) section 4.2 in the plane, of the kernel in blobs/blob.h.
struct PlaneBlob {
  double x = 0, y = 0;  ///< centre, length; y grows with the rows
  double sigma = 1;     ///< > 0
  double peak = 1;      ///< what it adds to the density at its centre
};

/// A cloud of blobs about the middle of a square, no two nearer than half of their mean sigma. The fewer
/// there are, the larger, so that they fill the same space.
std::vector<PlaneBlob> scatterBlobs(int count, double width, uint64_t seed);

/// The density that is their sum, at the centres of the cells.
PlaneField densityOf(const std::vector<PlaneBlob>& blobs, const PlaneGrid& grid);

/// How the equation is tested: in the mean over every blob, or at the blobs' centres as section 4.2 has it.
/// The paper counts on the blobs for the boundary condition: at the centres there is none. In the mean, the
/// faces where the last blob ends are open.
enum class PlaneBlobForm { kGalerkin, kCollocation };

/// The same blobs, as a basis with its sigmas times this.
std::vector<PlaneBlob> widened(std::vector<PlaneBlob> blobs, double factor);

/// psi_i = m_i G_i / sum_k m_k G_k in every cell of density that a blob reaches, listed cell by cell.
struct PlaneBasis {
  std::vector<size_t> first;  ///< by cell its first entry; one more at the end
  std::vector<int> blob;
  std::vector<double> value;
};
PlaneBasis planeBasis(const std::vector<PlaneBlob>& blobs, const PlaneMedium& medium);

struct PlaneBlobSolution {
  std::vector<double> I;  ///< by blob
  double condition = 0;   ///< of the system scaled to a unit diagonal; infinite: singular
  double seconds_form = 0, seconds_solve = 0;
};

/// Solves a system, formed of a medium on the grid that the integrals are summed over, in the span of the
/// blobs, by LU.
PlaneBlobSolution solvePlaneBlobs(const std::vector<PlaneBlob>& blobs, const PlaneMedium& medium,
                                  const PlaneSystem& system, PlaneBlobForm form);

/// I(x) = sum I_i psi_i; 0 where no blob reaches.
PlaneField evaluateBlobs(const PlaneBasis& basis, const std::vector<double>& I);

}  // namespace vdb_diffuse
