#include "plane/v_cycle.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace vdb_diffuse {
namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// A grid of the hierarchy, with its coefficients at hand.
struct Level {
  PlaneGrid grid;
  PlaneField east, south;  ///< conductance to the next column and to the next row; 0 at the boundary
  PlaneField diagonal;
  PlaneField x, b, r;
};

template <typename Body>
void forEachRow(const PlaneGrid& grid, const Body& body) {
  constexpr int kGrain = 32;  // rows a thread takes at a time
  tbb::parallel_for(tbb::blocked_range<int>(0, grid.ny, kGrain), [&](const auto& range) {
    for (int j = range.begin(); j != range.end(); ++j) body(j);
  });
}

Level levelOf(const PlaneOperator& A) {
  const PlaneGrid& grid = A.grid;
  const size_t n = grid.count();
  Level level{
      grid, PlaneField(n, 0), PlaneField(n, 0), A.sink, PlaneField(n, 0), PlaneField(n, 0), PlaneField(n, 0)};
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const size_t c = grid.at(i, j);
      for (const bool outer : {i == 0, i + 1 == grid.nx, j == 0, j + 1 == grid.ny})
        if (outer) level.diagonal[c] += A.boundary(c);
      if (i + 1 < grid.nx) {
        level.east[c] = A.between(c, c + 1);
        level.diagonal[c] += level.east[c];
        level.diagonal[c + 1] += level.east[c];
      }
      if (j + 1 < grid.ny) {
        const size_t below = grid.at(i, j + 1);
        level.south[c] = A.between(c, below);
        level.diagonal[c] += level.south[c];
        level.diagonal[below] += level.south[c];
      }
    }
  return level;
}

/// Sinks add up. A coarse cell is twice as wide, so that half of it resists twice as much.
PlaneOperator coarser(const PlaneOperator& A) {
  const PlaneGrid fine = A.grid, grid{fine.nx / 2, fine.ny / 2, 2 * fine.h};
  PlaneOperator coarse{grid, PlaneField(grid.count(), 0), PlaneField(grid.count(), 0)};
  for (int j = 0; j < fine.ny; ++j)
    for (int i = 0; i < fine.nx; ++i) {
      const size_t c = grid.at(i / 2, j / 2);
      coarse.r[c] += 2 * A.r[fine.at(i, j)] / 4;
      coarse.sink[c] += A.sink[fine.at(i, j)];
    }
  return coarse;
}

/// What flows to a cell from its neighbours.
double inflow(const Level& l, const PlaneField& x, int i, int j) {
  const int nx = l.grid.nx;
  const size_t c = l.grid.at(i, j);
  double sum = 0;
  if (i > 0) sum += l.east[c - 1] * x[c - 1];
  if (i + 1 < nx) sum += l.east[c] * x[c + 1];
  if (j > 0) sum += l.south[c - nx] * x[c - nx];
  if (j + 1 < l.grid.ny) sum += l.south[c] * x[c + nx];
  return sum;
}

/// Gauss-Seidel, red cells before black ones, so that the order of the rows does not matter.
void relax(Level& l) {
  for (const int colour : {0, 1})
    forEachRow(l.grid, [&](int j) {
      for (int i = (j + colour) & 1; i < l.grid.nx; i += 2) {
        const size_t c = l.grid.at(i, j);
        l.x[c] = (l.b[c] + inflow(l, l.x, i, j)) / l.diagonal[c];
      }
    });
}

void formResidual(Level& l) {
  forEachRow(l.grid, [&](int j) {
    for (int i = 0; i < l.grid.nx; ++i) {
      const size_t c = l.grid.at(i, j);
      l.r[c] = l.b[c] + inflow(l, l.x, i, j) - l.diagonal[c] * l.x[c];
    }
  });
}

double scaledNorm(const Level& l, const PlaneField& v) {
  double sum = 0;
  for (size_t c = 0; c < v.size(); ++c) sum += v[c] * v[c] / l.diagonal[c];
  return std::sqrt(sum);
}

/// What four cells have left is what their coarse cell has to mend.
void restrictResidual(const Level& fine, Level& coarse) {
  forEachRow(coarse.grid, [&](int j) {
    for (int i = 0; i < coarse.grid.nx; ++i) {
      const size_t a = fine.grid.at(2 * i, 2 * j), b = a + fine.grid.nx;
      coarse.b[coarse.grid.at(i, j)] = fine.r[a] + fine.r[a + 1] + fine.r[b] + fine.r[b + 1];
      coarse.x[coarse.grid.at(i, j)] = 0;
    }
  });
}

/// Bilinear between the centres of the coarse cells; constant beyond the outermost ones.
void prolongate(const Level& coarse, Level& fine) {
  forEachRow(fine.grid, [&](int j) {
    const int near_j = j / 2, far_j = std::clamp(near_j + (j % 2 ? 1 : -1), 0, coarse.grid.ny - 1);
    for (int i = 0; i < fine.grid.nx; ++i) {
      const int near_i = i / 2, far_i = std::clamp(near_i + (i % 2 ? 1 : -1), 0, coarse.grid.nx - 1);
      const auto x = [&](int ci, int cj) { return coarse.x[coarse.grid.at(ci, cj)]; };
      fine.x[fine.grid.at(i, j)] +=
          (9 * x(near_i, near_j) + 3 * x(far_i, near_j) + 3 * x(near_i, far_j) + x(far_i, far_j)) / 16;
    }
  });
}

class VCycle {
 public:
  VCycle(const PlaneSystem& system, const VCycleSettings& settings) : settings_(settings) {
    PlaneOperator A = system.A;
    levels_.push_back(levelOf(A));
    while ((settings.depth == 0 || static_cast<int>(levels_.size()) < settings.depth) && A.grid.nx % 2 == 0 &&
           A.grid.ny % 2 == 0) {
      A = coarser(A);
      levels_.push_back(levelOf(A));
    }
    levels_[0].b = system.b;
  }

  VCycleReport solve(PlaneField& x) {
    VCycleReport report;
    report.grids = static_cast<int>(levels_.size());
    Level& fine = levels_[0];
    const double start = now(), norm = scaledNorm(fine, fine.b);
    const auto record = [&] {
      formResidual(fine);
      report.residual.push_back(norm > 0 ? scaledNorm(fine, fine.r) / norm : 0);
      report.seconds.push_back(now() - start);
      report.converged = report.residual.back() <= settings_.tolerance;
    };
    record();
    while (!report.converged && static_cast<int>(report.residual.size()) <= settings_.max_cycles &&
           report.seconds.back() < settings_.max_seconds) {
      if (settings_.progress)
        settings_.progress("v-cycles", std::log(report.residual.back()) / std::log(settings_.tolerance));
      visits_ = report.visits.empty() ? &report.visits : nullptr;
      descend(0);
      record();
    }
    for (const int level : report.visits)
      report.work += static_cast<double>(levels_[level].grid.count()) / fine.grid.count();
    x = fine.x;
    return report;
  }

 private:
  const VCycleSettings settings_;
  std::vector<Level> levels_;
  std::vector<int>* visits_ = nullptr;  // of the first cycle

  void relaxSome(size_t level) {
    for (int n = 0; n < settings_.relaxations; ++n) {
      relax(levels_[level]);
      if (visits_) visits_->push_back(static_cast<int>(level));
    }
  }

  void descend(size_t level) {
    relaxSome(level);
    if (level + 1 == levels_.size()) return;
    formResidual(levels_[level]);
    restrictResidual(levels_[level], levels_[level + 1]);
    descend(level + 1);
    prolongate(levels_[level + 1], levels_[level]);
    relaxSome(level);
  }
};

}  // namespace

VCycleReport solveByVCycles(const PlaneSystem& system, PlaneField& x, const VCycleSettings& settings) {
  return VCycle(system, settings).solve(x);
}

void applyPlane(const PlaneOperator& A, const PlaneField& x, PlaneField& y) {
  Level l = levelOf(A);
  l.x = x;
  formResidual(l);
  y.resize(x.size());
  for (size_t c = 0; c < y.size(); ++c) y[c] = -l.r[c];
}

}  // namespace vdb_diffuse
