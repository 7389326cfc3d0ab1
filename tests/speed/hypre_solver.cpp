#include "hypre_solver.h"

#include <HYPRE_parcsr_mv.h>
#include <malloc.h>
#include <mpi.h>

#include <numeric>
#include <stdexcept>

namespace vdb_diffuse::speed {
namespace {

void require(HYPRE_Int error, const char* what) {
  if (error) throw std::runtime_error(std::string("hypre: ") + what + " failed");
}

size_t allocatedBytes() {
  const auto info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

HYPRE_Solver makePreconditioner(const HypreOptions& options) {
  HYPRE_Solver amg;
  require(HYPRE_BoomerAMGCreate(&amg), "creating BoomerAMG");
  constexpr int kExtendedPlusI = 6, kForward = 13, kBackward = 14, kDown = 1, kUp = 2, kEntries = 4;
  HYPRE_BoomerAMGSetPrintLevel(amg, 0);
  HYPRE_BoomerAMGSetTol(amg, 0);
  HYPRE_BoomerAMGSetMaxIter(amg, 1);
  HYPRE_BoomerAMGSetCoarsenType(amg, options.coarsening);
  HYPRE_BoomerAMGSetStrongThreshold(amg, options.strong_threshold);
  HYPRE_BoomerAMGSetAggNumLevels(amg, options.aggressive_levels);
  HYPRE_BoomerAMGSetInterpType(amg, kExtendedPlusI);
  HYPRE_BoomerAMGSetPMaxElmts(amg, kEntries);
  HYPRE_BoomerAMGSetKeepTranspose(amg, 1);  // quicker restriction for some memory
  HYPRE_BoomerAMGSetNumSweeps(amg, 1);
  HYPRE_BoomerAMGSetCycleRelaxType(amg, kForward, kDown);
  HYPRE_BoomerAMGSetCycleRelaxType(amg, kBackward, kUp);
  return amg;
}

HYPRE_Solver makeConjugateGradients(double tolerance, int iterations) {
  HYPRE_Solver pcg;
  require(HYPRE_ParCSRPCGCreate(MPI_COMM_SELF, &pcg), "creating PCG");
  HYPRE_ParCSRPCGSetTol(pcg, tolerance);
  HYPRE_ParCSRPCGSetMaxIter(pcg, iterations);
  return pcg;
}

HYPRE_Int noSetup(HYPRE_Solver, HYPRE_ParCSRMatrix, HYPRE_ParVector, HYPRE_ParVector) {
  return 0;
}

/// Stands between PCG and its preconditioner, which is handed every residual.
struct Observer {
  HYPRE_Solver amg;
  const Matrix* matrix;
  HypreHistory* history;
  Stopwatch watch;
  std::vector<double> r;
};

HYPRE_Int observeAndPrecondition(HYPRE_Solver self, HYPRE_ParCSRMatrix A, HYPRE_ParVector r,
                                 HYPRE_ParVector z) {
  Observer& observer = *reinterpret_cast<Observer*>(self);
  observer.history->seconds.push_back(observer.watch.read().cpu);
  HYPRE_ParVectorGetValues(r, static_cast<HYPRE_Int>(observer.r.size()), nullptr, observer.r.data());
  observer.history->residual.push_back(scaledNorm(*observer.matrix, observer.r));
  return HYPRE_BoomerAMGSolve(observer.amg, A, r, z);
}

HYPRE_IJVector makeVector(const std::vector<HYPRE_BigInt>& rows, const double* values,
                          HYPRE_ParVector& object) {
  HYPRE_IJVector vector;
  const HYPRE_BigInt last = static_cast<HYPRE_BigInt>(rows.size()) - 1;
  require(HYPRE_IJVectorCreate(MPI_COMM_SELF, 0, last, &vector), "creating a vector");
  HYPRE_IJVectorSetObjectType(vector, HYPRE_PARCSR);
  HYPRE_IJVectorInitialize(vector);
  HYPRE_IJVectorSetValues(vector, static_cast<HYPRE_Int>(rows.size()), rows.data(), values);
  require(HYPRE_IJVectorAssemble(vector), "filling a vector");
  void* p;
  HYPRE_IJVectorGetObject(vector, &p);
  object = static_cast<HYPRE_ParVector>(p);
  return vector;
}

}  // namespace

HypreSession::HypreSession() {
  MPI_Init(nullptr, nullptr);
  HYPRE_Init();
}

HypreSession::~HypreSession() {
  HYPRE_Finalize();
  MPI_Finalize();
}

std::string HypreOptions::name() const {
  char text[64];
  std::snprintf(text, sizeof text, "%s theta %.2f aggressive %d", coarsening == kPmis ? "PMIS" : "HMIS",
                strong_threshold, aggressive_levels);
  return text;
}

int HypreHistory::iterationsTo(double tolerance) const {
  for (size_t k = 0; k < residual.size(); ++k)
    if (residual[k] <= tolerance) return static_cast<int>(k);
  return -1;
}

HypreSystem::HypreSystem(const Matrix& matrix, const std::vector<double>& b)
    : matrix_(matrix), b_norm_(scaledNorm(matrix, b)) {
  const HYPRE_Int n = static_cast<HYPRE_Int>(matrix.rows());
  const size_t before = allocatedBytes();
  const Stopwatch watch;
  std::vector<HYPRE_BigInt> rows(matrix.rows());
  std::iota(rows.begin(), rows.end(), 0);
  std::vector<HYPRE_Int> lengths(matrix.rows()), none(matrix.rows(), 0);
  for (HYPRE_Int i = 0; i < n; ++i) lengths[i] = matrix.start[i + 1] - matrix.start[i];
  require(HYPRE_IJMatrixCreate(MPI_COMM_SELF, 0, n - 1, 0, n - 1, &matrix_handle_), "creating a matrix");
  HYPRE_IJMatrixSetObjectType(matrix_handle_, HYPRE_PARCSR);
  HYPRE_IJMatrixSetDiagOffdSizes(matrix_handle_, lengths.data(), none.data());
  HYPRE_IJMatrixInitialize(matrix_handle_);
  HYPRE_IJMatrixSetValues(matrix_handle_, n, lengths.data(), rows.data(), matrix.column.data(),
                          matrix.value.data());
  require(HYPRE_IJMatrixAssemble(matrix_handle_), "filling the matrix");
  void* p;
  HYPRE_IJMatrixGetObject(matrix_handle_, &p);
  A_ = static_cast<HYPRE_ParCSRMatrix>(p);
  const std::vector<double> zeros(matrix.rows(), 0.0);
  b_handle_ = makeVector(rows, b.data(), b_);
  x_handle_ = makeVector(rows, zeros.data(), x_);
  seconds_assembly_ = watch.read().wall;
  const size_t scratch = rows.capacity() * sizeof rows[0] + 2 * lengths.capacity() * sizeof lengths[0] +
                         zeros.capacity() * sizeof zeros[0];
  bytes_ = allocatedBytes() - before - scratch;
}

HypreSystem::~HypreSystem() {
  HYPRE_IJVectorDestroy(x_handle_);
  HYPRE_IJVectorDestroy(b_handle_);
  HYPRE_IJMatrixDestroy(matrix_handle_);
}

HypreHistory HypreSystem::observe(const HypreOptions& options, double tolerance) {
  HypreHistory history;
  const HYPRE_Solver amg = makePreconditioner(options);
  const Stopwatch setup_watch;
  require(HYPRE_BoomerAMGSetup(amg, A_, b_, x_), "setting up BoomerAMG");
  history.setup = setup_watch.read();
  constexpr int kMost = 1000;
  for (double stop = tolerance;; stop *= 0.01) {  // PCG stops on a norm of its own: until ours has passed too
    history.residual.clear();
    history.seconds.clear();
    const HYPRE_Solver pcg = makeConjugateGradients(stop, kMost);
    Observer observer{amg, &matrix_, &history, {}, std::vector<double>(matrix_.rows())};
    HYPRE_ParCSRPCGSetPrecond(pcg, observeAndPrecondition, noSetup,
                              reinterpret_cast<HYPRE_Solver>(&observer));
    HYPRE_ParCSRPCGSetup(pcg, A_, b_, x_);
    HYPRE_ParVectorSetConstantValues(x_, 0);
    observer.watch = Stopwatch();
    HYPRE_ParCSRPCGSolve(pcg, A_, b_, x_);
    HYPRE_ClearAllErrors();
    HYPRE_ParCSRPCGDestroy(pcg);
    for (double& r : history.residual) r /= b_norm_;
    if (history.iterationsTo(tolerance) >= 0) break;
    if (history.residual.size() > kMost) break;
  }
  HYPRE_BoomerAMGDestroy(amg);
  return history;
}

HypreRun HypreSystem::run(const HypreOptions& options, int iterations) {
  if (iterations < 0) throw std::runtime_error("hypre did not reach the tolerance with any options tried");
  HypreRun run;
  const size_t before = allocatedBytes();
  const HYPRE_Solver amg = makePreconditioner(options);
  const Stopwatch setup_watch;
  require(HYPRE_BoomerAMGSetup(amg, A_, b_, x_), "setting up BoomerAMG");
  run.setup = setup_watch.read();
  run.bytes = allocatedBytes() - before;

  const HYPRE_Solver pcg = makeConjugateGradients(0, iterations);
  HYPRE_ParCSRPCGSetPrecond(pcg, HYPRE_BoomerAMGSolve, noSetup, amg);
  const Stopwatch solve_watch;
  HYPRE_ParCSRPCGSetup(pcg, A_, b_, x_);
  HYPRE_ParVectorSetConstantValues(x_, 0);
  HYPRE_ParCSRPCGSolve(pcg, A_, b_, x_);
  run.solve = solve_watch.read();
  HYPRE_ClearAllErrors();  // that it did not reach a tolerance of zero
  HYPRE_ParCSRPCGGetNumIterations(pcg, &run.iterations);
  run.x.resize(matrix_.rows());
  HYPRE_ParVectorGetValues(x_, static_cast<HYPRE_Int>(run.x.size()), nullptr, run.x.data());
  HYPRE_ParCSRPCGDestroy(pcg);
  HYPRE_BoomerAMGDestroy(amg);
  return run;
}

}  // namespace vdb_diffuse::speed
