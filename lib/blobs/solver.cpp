#include "blobs/solver.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SparseCore>

namespace vdb_diffuse {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
using Sparse = Eigen::SparseMatrix<double, Eigen::RowMajor, int32_t>;

/// The eigenvalues that conjugate gradients have found come from the tridiagonal matrix of their steps, as
/// Lanczos's do (Golub and Van Loan 10.2); the ratio of the outermost is the condition number.
double lanczosCondition(const std::vector<double>& alpha, const std::vector<double>& beta) {
  const Eigen::Index n = static_cast<Eigen::Index>(alpha.size());
  if (n == 0) return 1;
  Vector diagonal(n), beside(std::max<Eigen::Index>(n - 1, 0));
  for (Eigen::Index k = 0; k < n; ++k) {
    diagonal[k] = 1 / alpha[k] + (k > 0 ? beta[k - 1] / alpha[k - 1] : 0);
    if (k + 1 < n) beside[k] = std::sqrt(beta[k]) / alpha[k];
  }
  Eigen::SelfAdjointEigenSolver<Matrix> eigen;
  eigen.computeFromTridiagonal(diagonal, beside, Eigen::EigenvaluesOnly);
  const double least = eigen.eigenvalues().minCoeff();
  return least > 0 ? eigen.eigenvalues().maxCoeff() / least : HUGE_VAL;
}

struct CgReport {
  double residual = 0, condition = 1;
  int iterations = 0;
};

CgReport conjugateGradients(const Sparse& A, const Vector& b, double tolerance, int most, Vector& x) {
  CgReport report;
  x = Vector::Zero(b.size());
  Vector r = b, p = b, q(b.size());
  double rr = r.squaredNorm();
  const double enough = tolerance * tolerance * rr;
  std::vector<double> alpha, beta;
  while (rr > enough && report.iterations < most) {
    q.noalias() = A * p;
    const double pq = p.dot(q);
    if (!(pq > 0)) break;
    alpha.push_back(rr / pq);
    x += alpha.back() * p;
    r -= alpha.back() * q;
    const double next = r.squaredNorm();
    beta.push_back(next / rr);
    p = r + beta.back() * p;
    rr = next;
    ++report.iterations;
  }
  report.residual = b.squaredNorm() > 0 ? (b - A * x).norm() / b.norm() : 0;
  report.condition = lanczosCondition(alpha, beta);
  return report;
}

}  // namespace

struct BlobSolver::Impl {
  Vector scale;  // 1 / sqrt(A_jj)
  Sparse A;      // scaled to a unit diagonal, before regularisation
  bool dense = true, regularised = false;
  double condition = 1, added = 0;  // to the unit diagonal
  Eigen::PartialPivLU<Matrix> lu;
};

BlobSolver::BlobSolver(const BlobSystem& system, BlobForm form) : impl_(std::make_unique<Impl>()) {
  Impl& s = *impl_;
  const int32_t n = static_cast<int32_t>(system.size());
  s.scale = Vector::Ones(n);
  std::vector<Eigen::Triplet<double, int32_t>> entries;
  for (int32_t j = 0; j < n; ++j)
    for (size_t e = system.first[j]; e < system.first[j + 1]; ++e)
      if (system.column[e] == j && system.value[e] != 0)
        s.scale[j] = 1 / std::sqrt(std::abs(system.value[e]));
  for (int32_t j = 0; j < n; ++j)
    for (size_t e = system.first[j]; e < system.first[j + 1]; ++e) {
      const int32_t i = system.column[e];
      entries.emplace_back(j, i, system.value[e] * s.scale[j] * s.scale[i]);
    }
  s.A.resize(n, n);
  s.A.setFromTriplets(entries.begin(), entries.end());
  s.dense = form == BlobForm::kCollocation || n <= kDenseBlobs;
  if (!s.dense || n == 0) return;
  const Matrix A(s.A);
  s.lu.compute(A);
  const auto condition = [&] { return s.lu.rcond() > 0 ? 1 / s.lu.rcond() : HUGE_VAL; };
  s.condition = condition();
  for (double add = 1 / kWorstCondition; add < 1 && !(condition() <= kWorstCondition); add *= 10) {
    s.regularised = true;
    s.added = add;
    s.lu.compute(A + add * Matrix::Identity(n, n));
  }
}

BlobSolver::~BlobSolver() = default;

std::vector<double> BlobSolver::solve(const std::vector<double>& b, double tolerance,
                                      BlobSolveReport& report) const {
  const Impl& s = *impl_;
  const Eigen::Index n = static_cast<Eigen::Index>(b.size());
  const Vector scaled = s.scale.cwiseProduct(Eigen::Map<const Vector>(b.data(), n));
  Vector x = Vector::Zero(n);
  report.regularised = s.regularised;
  report.condition_number = s.condition;
  const double norm = scaled.norm();
  report.iterations = norm > 0 ? 1 : 0;
  if (norm > 0 && s.dense) {
    x = s.lu.solve(scaled);
    report.relative_residual = (scaled - s.A * x - s.added * x).norm() / norm;
  } else if (norm > 0) {
    constexpr int kMost = 2000;
    CgReport cg = conjugateGradients(s.A, scaled, tolerance, kMost, x);
    report.condition_number = cg.condition;
    Sparse identity(n, n);
    identity.setIdentity();
    const auto bad = [&] { return cg.condition > kWorstCondition || cg.residual > 10 * tolerance; };
    for (double add = 1 / kWorstCondition; add < 0.1 && bad(); add *= 10) {
      cg = conjugateGradients(s.A + add * identity, scaled, tolerance, kMost, x);
      report.regularised = true;
    }
    report.iterations = cg.iterations;
    report.relative_residual = cg.residual;
  }
  report.converged = report.relative_residual <= 10 * tolerance;
  x = x.cwiseProduct(s.scale);
  return {x.data(), x.data() + n};
}

}  // namespace vdb_diffuse
