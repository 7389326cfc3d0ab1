#pragma once

#include <cstddef>
#include <vector>

namespace vdb_diffuse {

/// The two-dimensional domain of Stam (1995) section 5: a medium that does not change along the third axis,
/// lit in its plane. Square cells in rows; light comes in through row 0 and travels towards higher rows:
///
///        | | | | |        irradiance[i]
///        v v v v v
///     +--+--+--+--+--+
///     |  |  |  |  |  |    row j = 0
///     +--+--+--+--+--+
///     |  |  |  |  |  |    j = 1, ..., ny - 1
///     +--+--+--+--+--+
///
/// Directions are those of space, so that light in the plane is light in three dimensions and D is 1/(3
/// sigma_tr rho) here too.

struct PlaneGrid {
  int nx = 0, ny = 0;
  double h = 1;  ///< side of a cell, length

  size_t count() const { return static_cast<size_t>(nx) * ny; }
  size_t at(int i, int j) const { return static_cast<size_t>(j) * nx + i; }
};

/// A value for every cell, row after row.
using PlaneField = std::vector<double>;

struct PlaneMedium {
  PlaneGrid grid;
  PlaneField rho;         ///< >= 0
  double sigma_s = 1;     ///< scattering per unit density, 1/(length density), >= 0
  double sigma_a = 0;     ///< absorption per unit density, >= 0
  double g = 0;           ///< mean scattering cosine; the paper's mu_bar is 3 g
  PlaneField irradiance;  ///< on row 0, by column

  double sigma_t() const { return sigma_s + sigma_a; }
  double sigma_tr() const { return sigma_a + (1 - g) * sigma_s; }
};

/// I_ri0 = Q0: the mean over each cell of E exp(-tau) / (4 pi), exact for cells of constant density.
PlaneField directLight(const PlaneMedium& medium);

/// Means of blocks of `width`^2 cells; nx and ny are multiples of it.
PlaneField blockMeans(const PlaneGrid& grid, const PlaneField& field, int width);

/// Each value `width`^2 times.
PlaneField repeated(const PlaneGrid& grid, const PlaneField& field, int width);

/// sqrt(sum w (a-b)^2 / sum w b^2 - noise^2), 0 where the noise is the larger; noise^2 = sum w se^2 / sum w
/// b^2. \param se  standard error of b; empty: none
double relativeRms(const PlaneField& a, const PlaneField& b, const PlaneField& weight,
                   const PlaneField& se = {});

}  // namespace vdb_diffuse
