#include "multigrid/solve.h"

#include <cmath>
#include <limits>

#include "grid/row.h"

namespace vdb_diffuse {
namespace {

double sum(const Field<float>& a) {
  return sumOverBlocks<double>(a.blockCount(), [&](size_t block) {
    double s = 0;
    for (int n = 0; n < kBlockVoxels; ++n) s += a.block(block)[n];
    return s;
  });
}

/// p = z + beta p, q = A p = w + beta q, x += alpha p, r -= alpha q; returns the squared scaled norm of r.
VDB_DIFFUSE_KERNEL double stepInBlock(float alpha, float beta, const float* z, const float* w,
                                      const float* inverse, float* p, float* q, double* x, float* r) {
  DoubleRow norm = {};
  for (int n = 0; n < kBlockVoxels; n += 8) {
    const Row along = loadRow(z + n) + beta * loadRow(p + n), image = loadRow(w + n) + beta * loadRow(q + n);
    const Row left = loadRow(r + n) - alpha * image;
    storeRow(p + n, along);
    storeRow(q + n, image);
    storeRow(r + n, left);
    DoubleRow sum = loadDoubles(x + n);
    sum += static_cast<double>(alpha) * widen(along);
    storeDoubles(x + n, sum);
    norm += widen(left) * widen(left) * widen(loadRow(inverse + n));
  }
  return sumOf(norm);
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
  Field<float> r(*A.topology), z(*A.topology), w(*A.topology), p(*A.topology), q(*A.topology);
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

    double previous_rz = 0, alpha = 0;
    p.fill(0);
    q.fill(0);
    for (bool first = true; report.iterations < settings.max_iterations; first = false) {
      const Products now = multigrid.precondition(r, z, w);
      const double beta = first ? 0 : now.bx / previous_rz;
      const double curvature = first ? now.xAx : now.xAx - beta * now.bx / alpha;  // p.A p
      if (!(curvature > 0) || !(now.bx > 0)) return report;  // nothing left that floats can express
      previous_rz = now.bx;
      alpha = now.bx / curvature;
      const double norm_squared = sumOverBlocks<double>(r.blockCount(), [&](size_t b) {
        return stepInBlock(static_cast<float>(alpha), static_cast<float>(beta), z.block(b), w.block(b),
                           A.inverse_diagonal.block(b), p.block(b), q.block(b), x.block(b), r.block(b));
      });
      const double norm = std::sqrt(norm_squared) / b_norm;
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
