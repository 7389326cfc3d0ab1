#pragma once

#include <limits>

#include "plane/plane.h"

namespace vdb_diffuse {

// The diffusion equation in the plane, corrected or as Stam (1995) prints it; diffusion/equation.h derives
// the one from the other. On either form a cell has a half resistance r = h/(2D), or h/(2 kappa), and
//
//     from cell i to cell j       h (I_i - I_j) / (r_i + r_j)
//     out through the boundary    h I_i / (r_i + 2)
//
// flows; all that the light drives stands on the right-hand side.
enum class PlaneForm {
  kCorrected,  ///< plain P1 with the Marshak condition, D = 1/(3 sigma_tr rho)
  kPrinted  ///< kappa = 1/(sigma_tr rho); source and boundary flux of sections 3 and 5.1, with mu_bar = 3 g
};

/// A symmetric system on a grid: half resistances, sinks, and the conductance of the boundary's faces.
struct PlaneOperator {
  PlaneGrid grid;
  PlaneField r;     ///< half a cell's resistance
  PlaneField sink;  ///< h^2 sigma_a rho

  double between(size_t a, size_t b) const { return grid.h / (r[a] + r[b]); }
  double boundary(size_t a) const { return grid.h / (r[a] + 2); }
};

struct PlaneSystem {
  PlaneOperator A;
  PlaneField b;
};

/// \param cap  L of D = 1/(3 max(sigma_tr rho, 1/L)), length; needed where the density vanishes
PlaneSystem formPlaneSystem(const PlaneMedium& medium, PlaneForm form,
                            double cap = std::numeric_limits<double>::infinity());

/// Flux of I0 per area out of the medium, that is I1/3, by column: through row 0 and through the last row.
struct PlaneExit {
  PlaneField reflected, transmitted;
};

/// Of the corrected form: 4 pi times these are W/m2.
PlaneExit exitOf(const PlaneMedium& medium, const PlaneSystem& system, const PlaneField& I0);

}  // namespace vdb_diffuse
