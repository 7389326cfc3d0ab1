#include "plane/plane.h"

#include <algorithm>
#include <cmath>

namespace vdb_diffuse {

PlaneField directLight(const PlaneMedium& medium) {
  const PlaneGrid& grid = medium.grid;
  PlaneField Q0(grid.count());
  for (int i = 0; i < grid.nx; ++i) {
    double before = medium.irradiance[i] / (4 * M_PI);
    for (int j = 0; j < grid.ny; ++j) {
      const double tau = medium.sigma_t() * medium.rho[grid.at(i, j)] * grid.h;
      Q0[grid.at(i, j)] = tau > 0 ? before * -std::expm1(-tau) / tau : before;
      before *= std::exp(-tau);
    }
  }
  return Q0;
}

PlaneField blockMeans(const PlaneGrid& grid, const PlaneField& field, int width) {
  const PlaneGrid coarse{grid.nx / width, grid.ny / width, grid.h * width};
  PlaneField means(coarse.count(), 0.0);
  for (int j = 0; j < coarse.ny * width; ++j)
    for (int i = 0; i < coarse.nx * width; ++i)
      means[coarse.at(i / width, j / width)] += field[grid.at(i, j)] / (width * width);
  return means;
}

PlaneField repeated(const PlaneGrid& grid, const PlaneField& field, int width) {
  const PlaneGrid fine{grid.nx * width, grid.ny * width, grid.h / width};
  PlaneField values(fine.count());
  for (int j = 0; j < fine.ny; ++j)
    for (int i = 0; i < fine.nx; ++i) values[fine.at(i, j)] = field[grid.at(i / width, j / width)];
  return values;
}

double relativeRms(const PlaneField& a, const PlaneField& b, const PlaneField& weight, const PlaneField& se) {
  double apart = 0, square = 0;
  for (size_t c = 0; c < b.size(); ++c) {
    const double noise = se.empty() ? 0 : se[c];
    apart += weight[c] * ((a[c] - b[c]) * (a[c] - b[c]) - noise * noise);
    square += weight[c] * b[c] * b[c];
  }
  return square > 0 ? std::sqrt(std::max(0.0, apart) / square) : 0;
}

}  // namespace vdb_diffuse
