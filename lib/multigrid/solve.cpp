#include "multigrid/solve.h"

#include <cmath>
#include <limits>

namespace vdb_diffuse {
namespace {

double dot(const Field<float>& a, const Field<float>& b) {
  return sumOverBlocks<double>(a.blockCount(), [&](size_t block) {
    const float *u = a.block(block), *v = b.block(block);
    double sum = 0;
    for (int n = 0; n < kBlockVoxels; ++n) sum += static_cast<double>(u[n]) * v[n];
    return sum;
  });
}

double sum(const Field<float>& a) {
  return sumOverBlocks<double>(a.blockCount(), [&](size_t block) {
    double s = 0;
    for (int n = 0; n < kBlockVoxels; ++n) s += a.block(block)[n];
    return s;
  });
}

/// p = z + beta p
void newDirection(const Field<float>& z, float beta, Field<float>& p) {
  forEachBlock(p.blockCount(), [&](size_t block) {
    float* u = p.block(block);
    const float* v = z.block(block);
    for (int n = 0; n < kBlockVoxels; ++n) u[n] = v[n] + beta * u[n];
  });
}

/// x += alpha p, r -= alpha q; returns the squared scaled norm of the new r.
double step(const Operator& A, double alpha, const Field<float>& p, const Field<float>& q, Field<double>& x,
            Field<float>& r) {
  const float a = static_cast<float>(alpha);
  return sumOverBlocks<double>(x.blockCount(), [&](size_t block) {
    double* to = x.block(block);
    float* left = r.block(block);
    const float *u = p.block(block), *v = q.block(block), *inverse = A.inverse_diagonal.block(block);
    double norm = 0;
    for (int n = 0; n < kBlockVoxels; ++n) {
      to[n] += static_cast<double>(a) * u[n];
      left[n] -= a * v[n];
      norm += static_cast<double>(left[n]) * left[n] * inverse[n];
    }
    return norm;
  });
}

// A residual that the recurrence claims below this part of its start is compared with the true one: float
// recurrences drift from the truth by their rounding.
constexpr double kReplaceAfter = 1e-7;
// A restart that leaves more than this part of the true residual has met the rounding of the float
// corrections.
constexpr double kStagnation = 0.9;

}  // namespace

SolveReport solve(Multigrid& multigrid, const Field<float>& b, Field<double>& x,
                  const SolveSettings& settings) {
  const Operator& A = multigrid.finest();
  SolveReport report;
  const double b_norm = std::sqrt(scaledNormSquared(A, b));
  if (b_norm == 0) {
    x.fill(0);
    report.converged = true;
    return report;
  }
  const double b_sum = std::abs(sum(b));
  Field<float> r(*A.topology), z(*A.topology), p(*A.topology), q(*A.topology);
  double previous = std::numeric_limits<double>::infinity();
  double tighter = 0.95;  // the recurrence aims below the tolerance, since the truth is a little above it
  while (true) {
    residual(A, b, x, r);
    const double start = std::sqrt(scaledNormSquared(A, r)) / b_norm;
    report.relative_residual = start;
    report.balance = b_sum > 0 ? std::abs(sum(r)) / b_sum : 0;
    const bool balanced = settings.balance <= 0 || report.balance <= settings.balance;
    report.converged = start <= settings.tolerance && balanced;
    if (report.converged || report.iterations >= settings.max_iterations || !std::isfinite(start))
      return report;
    if (start > kStagnation * previous) return report;  // as near as floats come
    previous = start;
    double target = std::max(tighter * std::min(settings.tolerance, start), kReplaceAfter * start);
    tighter *= 0.5;

    double rho = 0;
    p.fill(0);
    for (bool first = true; report.iterations < settings.max_iterations; first = false) {
      multigrid.precondition(r, z);
      const double rho_next = dot(r, z);
      newDirection(z, first ? 0.0f : static_cast<float>(rho_next / rho), p);
      rho = rho_next;
      const double curvature = apply(A, p, q);
      if (!(curvature > 0) || !(rho > 0)) return report;  // nothing left that floats can express
      const double norm = std::sqrt(step(A, rho / curvature, p, q, x, r)) / b_norm;
      ++report.iterations;
      report.residual.push_back(norm);
      if (settings.progress) {
        const double done = std::log(norm) / std::log(settings.tolerance);
        settings.progress("solve", std::min(1.0, std::max(0.0, done)));
      }
      if (norm <= target) break;
    }
  }
}

}  // namespace vdb_diffuse
