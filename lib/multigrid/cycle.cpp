#include "multigrid/cycle.h"

#include <Eigen/Cholesky>

#include "multigrid/block_kernel.h"

namespace vdb_diffuse {

/// Cholesky factors of the coarsest operator.
struct Multigrid::DirectSolver {
  std::vector<size_t> place;  // of each unknown in the fields
  Eigen::LDLT<Eigen::MatrixXd> factors;

  explicit DirectSolver(const Operator& A) {
    const Topology& topology = *A.topology;
    Field<int32_t> unknown(topology, -1);
    for (size_t b = 0; b < topology.blockCount(); ++b)
      for (int n = 0; n < kBlockVoxels; ++n)
        if (A.inverse_diagonal.block(b)[n] > 0) {
          unknown.block(b)[n] = static_cast<int32_t>(place.size());
          place.push_back(b * kBlockVoxels + n);
        }
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(place.size(), place.size());
    for (size_t b = 0; b < topology.blockCount(); ++b) {
      BlockFaces g;
      Halo<int32_t> index;
      loadFaces(A, b, g);
      loadHalo(topology, unknown, b, -1, index);
      const auto join = [&](int i, int j, float conductance) {
        if (i < 0 || j < 0) return;
        matrix(i, i) += conductance;
        matrix(i, j) -= conductance;
      };
      for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y)
          for (int z = 0; z < 8; ++z) {
            const int i = index.row(x, y)[z];
            if (i < 0) continue;
            matrix(i, i) += A.sink.block(b)[voxelOffset(x, y, z)];
            join(i, index.row(x - 1, y)[z], g.x[x][y][z]);
            join(i, index.row(x + 1, y)[z], g.x[x + 1][y][z]);
            join(i, index.row(x, y - 1)[z], g.y[x][y][z]);
            join(i, index.row(x, y + 1)[z], g.y[x][y + 1][z]);
            join(i, index.at(x, y, z - 1), g.below[x][y][z]);
            join(i, index.at(x, y, z + 1), g.above[x][y][z]);
          }
    }
    factors.compute(matrix);
  }

  void solve(const Field<float>& b, Field<float>& x) const {
    Eigen::VectorXd rhs(place.size());
    for (size_t i = 0; i < place.size(); ++i) rhs[i] = b[place[i]];
    const Eigen::VectorXd solution = factors.solve(rhs);
    x.fill(0);
    for (size_t i = 0; i < place.size(); ++i) x[place[i]] = static_cast<float>(solution[i]);
  }
};

Multigrid::~Multigrid() = default;
Multigrid::Multigrid(Multigrid&&) noexcept = default;

Multigrid::Multigrid(std::shared_ptr<const Operator> finest, const CycleSettings& settings)
    : settings_(settings) {
  Wave wave(*finest->topology);
  levels_.push_back({std::move(finest), std::move(wave), {}, {}, {}});
  while (true) {
    Level& fine = levels_.back();
    const size_t unknowns = fine.A->topology->activeVoxelCount();
    if (unknowns <= settings_.direct_unknowns) {
      direct_ = std::make_unique<DirectSolver>(*fine.A);
      break;
    }
    Transfer transfer;
    Parts parts = fine.A->finest() ? separatePieces(*fine.A) : wholeBlocks(*fine.A->topology);
    auto coarse = std::make_shared<const Operator>(coarsen(*fine.A, std::move(parts), transfer));
    // Pieces too far apart to merge leave one voxel each, which the smoother solves exactly.
    if (10 * coarse->topology->activeVoxelCount() > 9 * unknowns) break;
    fine.to_coarse = std::move(transfer);
    Field<float> x(*coarse->topology), b(*coarse->topology);
    Wave coarse_wave(*coarse->topology);
    levels_.push_back({std::move(coarse), std::move(coarse_wave), {}, std::move(x), std::move(b)});
  }
}

void Multigrid::cycle(size_t l, const Field<float>& b, Field<float>& x) {
  Level& level = levels_[l];
  const Operator& A = *level.A;
  if (l + 1 == levels_.size()) return solveCoarsest(b, x);
  Level& coarse = levels_[l + 1];
  downStroke(A, level.wave, settings_.sweeps, b, x, level.to_coarse, coarse.b);
  cycle(l + 1, coarse.b, coarse.x);
  upStroke(A, level.wave, settings_.sweeps, level.to_coarse, *coarse.A->topology, coarse.x, b, x);
}

void Multigrid::solveCoarsest(const Field<float>& b, Field<float>& x) {
  Level& level = levels_.back();
  if (direct_) return direct_->solve(b, x);
  smoothAlone(*level.A, level.wave, settings_.sweeps, settings_.coarsest_sweeps, b, x);
}

void Multigrid::precondition(const Field<float>& r, Field<float>& z) {
  cycle(0, r, z);
}

Products Multigrid::precondition(const Field<float>& r, Field<float>& z, Field<float>& Az) {
  Level& level = levels_.front();
  const Operator& A = *level.A;
  if (levels_.size() == 1) {
    solveCoarsest(r, z);
    const double zAz = apply(A, z, Az);
    return {dot(r, z), zAz};
  }
  Level& coarse = levels_[1];
  downStroke(A, level.wave, settings_.sweeps, r, z, level.to_coarse, coarse.b);
  cycle(1, coarse.b, coarse.x);
  return upStroke(A, level.wave, settings_.sweeps, level.to_coarse, *coarse.A->topology, coarse.x, r, z, Az);
}

size_t Multigrid::bytes() const {
  size_t bytes = 0;
  for (const Level& level : levels_) {
    const Operator& A = *level.A;
    for (const Field<float>* f : {&A.half_resistance, &A.faces[0], &A.faces[1], &A.faces[2], &A.sink,
                                  &A.inverse_diagonal, &level.x, &level.b, &level.to_coarse.spill})
      bytes += f->size() * sizeof(float);
    bytes += A.topology->bytes();
  }
  return bytes;
}

}  // namespace vdb_diffuse
