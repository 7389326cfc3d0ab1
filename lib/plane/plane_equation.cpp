#include "plane/plane_equation.h"

#include <algorithm>
#include <cmath>

namespace vdb_diffuse {
namespace {

/// sigma_s rho Q1 along the light, Q1 = 3 g Q0.
double driveAt(const PlaneMedium& m, const PlaneField& Q0, size_t c) {
  return m.sigma_s * m.rho[c] * 3 * m.g * Q0[c];
}

/// The corrected right-hand side: sources, and the drive inside the flux through every face.
void addCorrected(const PlaneMedium& m, const PlaneField& Q0, PlaneSystem& system) {
  const PlaneGrid& grid = m.grid;
  const double h = grid.h;
  for (int i = 0; i < grid.nx; ++i)
    for (int j = 0; j < grid.ny; ++j) {
      const size_t c = grid.at(i, j);
      system.b[c] += h * h * m.sigma_s * m.rho[c] * Q0[c];
      const double q = driveAt(m, Q0, c);
      if (j == 0) system.b[c] += system.A.boundary(c) * 0.5 * h * q;
      if (j + 1 == grid.ny) {
        system.b[c] -= system.A.boundary(c) * 0.5 * h * q;
        continue;
      }
      const size_t next = grid.at(i, j + 1);
      const double flow = system.A.between(c, next) * 0.5 * h * (q + driveAt(m, Q0, next));
      system.b[c] -= flow;
      system.b[next] += flow;
    }
}

/// As printed in 5.1: S = rho (sigma_s + sigma_s sigma_t / sigma_tr mu_bar) Q0, and on the boundary
/// I - 2 kappa dI/dn + 2 n.Q = 0 with Q = sigma_s mu_bar / sigma_tr Q0 along the light, n inward.
void addPrinted(const PlaneMedium& m, const PlaneField& Q0, PlaneSystem& system) {
  const PlaneGrid& grid = m.grid;
  const double h = grid.h, mu_bar = 3 * m.g, ratio = m.sigma_s / m.sigma_tr() * mu_bar;
  for (size_t c = 0; c < Q0.size(); ++c)
    system.b[c] += h * h * m.rho[c] * (m.sigma_s + m.sigma_t() * ratio) * Q0[c];
  for (int i = 0; i < grid.nx; ++i) {
    const size_t first = grid.at(i, 0), last = grid.at(i, grid.ny - 1);
    system.b[first] -= system.A.boundary(first) * 2 * ratio * Q0[first];
    system.b[last] += system.A.boundary(last) * 2 * ratio * Q0[last];
  }
}

}  // namespace

PlaneSystem formPlaneSystem(const PlaneMedium& m, PlaneForm form, double cap) {
  const PlaneField Q0 = directLight(m);
  const bool printed = form == PlaneForm::kPrinted;
  PlaneSystem system{{m.grid, PlaneField(m.grid.count()), PlaneField(m.grid.count())},
                     PlaneField(m.grid.count(), 0.0)};
  for (size_t c = 0; c < m.rho.size(); ++c) {
    const double transport = std::max(m.sigma_tr() * m.rho[c], 1 / cap);
    system.A.r[c] = 0.5 * m.grid.h * transport * (printed ? 1 : 3);
    system.A.sink[c] = m.grid.h * m.grid.h * m.sigma_a * m.rho[c];
  }
  printed ? addPrinted(m, Q0, system) : addCorrected(m, Q0, system);
  return system;
}

PlaneExit exitOf(const PlaneMedium& m, const PlaneSystem& system, const PlaneField& I0) {
  const PlaneField Q0 = directLight(m);
  const double h = m.grid.h;
  PlaneExit exit;
  for (int i = 0; i < m.grid.nx; ++i) {
    const size_t first = m.grid.at(i, 0), last = m.grid.at(i, m.grid.ny - 1);
    exit.reflected.push_back((I0[first] - 0.5 * h * driveAt(m, Q0, first)) / (system.A.r[first] + 2));
    exit.transmitted.push_back((I0[last] + 0.5 * h * driveAt(m, Q0, last)) / (system.A.r[last] + 2));
  }
  return exit;
}

}  // namespace vdb_diffuse
