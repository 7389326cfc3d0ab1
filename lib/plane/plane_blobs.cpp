#include "plane/plane_blobs.h"

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>

#include "blobs/fit.h"
#include "reference/random.h"

namespace vdb_diffuse {
namespace {

using Matrix = Eigen::MatrixXd;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double weightAt(const PlaneBlob& b, double x, double y) {
  const double q = ((x - b.x) * (x - b.x) + (y - b.y) * (y - b.y)) / (b.sigma * b.sigma);
  return b.peak * blobKernel(q).value;
}

/// Columns or rows whose centres lie within `reach` of `centre`.
std::pair<int, int> within(double centre, double reach, double h, int n) {
  return {std::max(0, static_cast<int>(std::ceil((centre - reach) / h - 0.5))),
          std::min(n - 1, static_cast<int>(std::floor((centre + reach) / h - 0.5)))};
}

/// body(cell, weight) for the cells that a blob reaches.
template <typename Body>
void forEachCell(const PlaneBlob& b, const PlaneGrid& grid, const Body& body) {
  const double reach = kBlobReach * b.sigma;
  const auto [i0, i1] = within(b.x, reach, grid.h, grid.nx);
  const auto [j0, j1] = within(b.y, reach, grid.h, grid.ny);
  for (int j = j0; j <= j1; ++j)
    for (int i = i0; i <= i1; ++i)
      if (const double w = weightAt(b, (i + 0.5) * grid.h, (j + 0.5) * grid.h); w > 0) body(grid.at(i, j), w);
}

size_t cellOf(const PlaneBlob& b, const PlaneGrid& grid) {
  const auto index = [&](double at, int n) { return std::clamp(static_cast<int>(at / grid.h), 0, n - 1); };
  return grid.at(index(b.x, grid.nx), index(b.y, grid.ny));
}

/// A face between two cells that blobs reach conducts; one toward the others is open.
struct Faces {
  const PlaneOperator& A;
  const PlaneBasis& basis;

  bool covered(size_t c) const { return basis.first[c] < basis.first[c + 1]; }

  /// inner(c, neighbour) for every inner face, once, and open(c) for every open one.
  template <typename Inner, typename Open>
  void forEach(const Inner& inner, const Open& open) const {
    const PlaneGrid& grid = A.grid;
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        const size_t c = grid.at(i, j);
        if (!covered(c)) continue;
        const auto face = [&](int di, int dj) {
          const int p = i + di, q = j + dj;
          if (p < 0 || q < 0 || p >= grid.nx || q >= grid.ny || !covered(grid.at(p, q)))
            open(c);
          else if (di + dj > 0)
            inner(c, grid.at(p, q));
        };
        face(1, 0), face(-1, 0), face(0, 1), face(0, -1);
      }
  }
};

/// M_ij = sum over faces of conductance (psi_i - psi_i')(psi_j - psi_j'), and of leaks and sinks psi_i psi_j.
void formGalerkin(const PlaneSystem& system, const PlaneBasis& basis, Matrix& M, Eigen::VectorXd& b) {
  const PlaneOperator& A = system.A;
  std::vector<double> sink = A.sink;
  std::vector<std::pair<int, double>> jump;
  const auto addSquares = [&](double factor) {
    for (const auto& [i, u] : jump)
      for (const auto& [j, v] : jump) M(i, j) += factor * u * v;
  };
  const auto take = [&](size_t c, double sign) {
    for (size_t e = basis.first[c]; e < basis.first[c + 1]; ++e)
      jump.emplace_back(basis.blob[e], sign * basis.value[e]);
  };
  Faces{A, basis}.forEach(
      [&](size_t c, size_t d) {
        jump.clear();
        take(c, 1);
        take(d, -1);
        addSquares(A.between(c, d));
      },
      [&](size_t c) { sink[c] += A.boundary(c); });
  for (size_t c = 0; c < sink.size(); ++c) {
    jump.clear();
    take(c, 1);
    addSquares(sink[c]);
    for (const auto& [i, u] : jump) b[i] += u * system.b[c];
  }
}

/// The equation of the cell that a blob's centre lies in.
void formCollocation(const std::vector<PlaneBlob>& blobs, const PlaneSystem& system, const PlaneBasis& basis,
                     Matrix& M, Eigen::VectorXd& b) {
  const PlaneOperator& A = system.A;
  const PlaneGrid& grid = A.grid;
  for (size_t row = 0; row < blobs.size(); ++row) {
    const size_t c = cellOf(blobs[row], grid);
    const int i = static_cast<int>(c % grid.nx), j = static_cast<int>(c / grid.nx);
    const auto add = [&](size_t cell, double factor) {
      for (size_t e = basis.first[cell]; e < basis.first[cell + 1]; ++e)
        M(row, basis.blob[e]) += factor * basis.value[e];
    };
    const auto face = [&](bool exists, size_t neighbour) {
      if (!exists) return;
      add(c, A.between(c, neighbour));
      add(neighbour, -A.between(c, neighbour));
    };
    add(c, A.sink[c]);
    face(i > 0, c - 1);
    face(i + 1 < grid.nx, c + 1);
    face(j > 0, c - grid.nx);
    face(j + 1 < grid.ny, c + grid.nx);
    b[row] = system.b[c];
  }
}

}  // namespace

std::vector<PlaneBlob> scatterBlobs(int count, double width, uint64_t seed) {
  constexpr double kReach = 0.26;  // of the cloud, in widths
  const double size = 0.075 * std::sqrt(76.0 / count) * width;
  RandomStream random(seed);
  const auto draw = [&](double low, double high) { return low + (high - low) * random.uniform(); };
  std::vector<PlaneBlob> blobs;
  while (static_cast<int>(blobs.size()) < count) {
    PlaneBlob b;
    float x, y;
    random.disc(x, y);
    b.x = width * (0.5 + 1.25 * kReach * x);  // wider than high, as clouds are
    b.y = width * (0.5 + 0.85 * kReach * y);
    b.sigma = size * draw(0.5, 1);
    b.peak = draw(0.3, 1);
    const bool close = std::any_of(blobs.begin(), blobs.end(), [&](const PlaneBlob& o) {
      return std::hypot(b.x - o.x, b.y - o.y) < kClosestBlobs * 0.5 * (b.sigma + o.sigma);
    });
    if (!close) blobs.push_back(b);
  }
  return blobs;
}

PlaneField densityOf(const std::vector<PlaneBlob>& blobs, const PlaneGrid& grid) {
  PlaneField rho(grid.count(), 0.0);
  for (const PlaneBlob& b : blobs) forEachCell(b, grid, [&](size_t c, double w) { rho[c] += w; });
  return rho;
}

std::vector<PlaneBlob> widened(std::vector<PlaneBlob> blobs, double factor) {
  for (PlaneBlob& b : blobs) {
    b.sigma *= factor;
    b.peak /= factor * factor;  // of the same mass
  }
  return blobs;
}

PlaneBasis planeBasis(const std::vector<PlaneBlob>& blobs, const PlaneMedium& medium) {
  const PlaneGrid& grid = medium.grid;
  std::vector<size_t> count(grid.count() + 1, 0);
  PlaneField sum(grid.count(), 0.0);
  for (const PlaneBlob& b : blobs)
    forEachCell(b, grid, [&](size_t c, double w) {
      if (!(medium.rho[c] > 0)) return;
      ++count[c + 1];
      sum[c] += w;
    });
  for (size_t c = 0; c < grid.count(); ++c) count[c + 1] += count[c];
  PlaneBasis basis{count, std::vector<int>(count.back()), std::vector<double>(count.back())};
  for (size_t i = 0; i < blobs.size(); ++i)
    forEachCell(blobs[i], grid, [&](size_t c, double w) {
      if (!(medium.rho[c] > 0)) return;
      const size_t e = count[c]++;
      basis.blob[e] = static_cast<int>(i);
      basis.value[e] = w / sum[c];
    });
  return basis;
}

PlaneBlobSolution solvePlaneBlobs(const std::vector<PlaneBlob>& blobs, const PlaneMedium& medium,
                                  const PlaneSystem& system, PlaneBlobForm form) {
  const double start = now();
  const Eigen::Index n = static_cast<Eigen::Index>(blobs.size());
  Matrix M = Matrix::Zero(n, n);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(n);
  const PlaneBasis basis = planeBasis(blobs, medium);
  if (form == PlaneBlobForm::kGalerkin)
    formGalerkin(system, basis, M, b);
  else
    formCollocation(blobs, system, basis, M, b);
  const double formed = now();
  const Eigen::VectorXd scale = M.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
  const Matrix scaled = scale.asDiagonal() * M * scale.asDiagonal();
  const Eigen::PartialPivLU<Matrix> lu(scaled);
  const Eigen::VectorXd x = scale.cwiseProduct(lu.solve(scale.cwiseProduct(b)));
  PlaneBlobSolution solution;
  solution.I.assign(x.data(), x.data() + n);
  solution.condition = lu.rcond() > 0 ? 1 / lu.rcond() : HUGE_VAL;
  solution.seconds_form = formed - start;
  solution.seconds_solve = now() - formed;
  return solution;
}

PlaneField evaluateBlobs(const PlaneBasis& basis, const std::vector<double>& I) {
  PlaneField field(basis.first.size() - 1, 0.0);
  for (size_t c = 0; c < field.size(); ++c)
    for (size_t e = basis.first[c]; e < basis.first[c + 1]; ++e)
      field[c] += I[basis.blob[e]] * basis.value[e];
  return field;
}

}  // namespace vdb_diffuse
