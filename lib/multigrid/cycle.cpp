#include "multigrid/cycle.h"

#include <Eigen/Cholesky>

#include "multigrid/block_kernel.h"

namespace vdb_diffuse {
namespace {

// Twins of a level, at most, so that memory and time stay bounded. Clouds of 0.3, 2 and 8 M voxels have 688,
// 2,109 and 4,752 where they have most, and without a cap on the mean free path 1,480 and 4,965. What would
// have more is noise, and better off without: with 40,000, half of 160^3 voxels took 52 iterations instead
// of 45.
constexpr size_t kFewTwins = 1000;
constexpr size_t kVoxelsPerTwin = 300;  ///< finest ones, beside those

}  // namespace

/// Cholesky factors of the coarsest operator, its twins after its voxels.
struct Multigrid::DirectSolver {
  std::vector<size_t> place;  // of each unknown in the fields
  Eigen::LDLT<Eigen::MatrixXd> factors;

  DirectSolver(const Operator& A, const Twins& twins) {
    const Topology& topology = *A.topology;
    Field<int32_t> unknown(topology, -1);
    for (size_t b = 0; b < topology.blockCount(); ++b)
      for (int n = 0; n < kBlockVoxels; ++n)
        if (A.inverse_diagonal.block(b)[n] > 0) {
          unknown.block(b)[n] = static_cast<int32_t>(place.size());
          place.push_back(b * kBlockVoxels + n);
        }
    const size_t voxels = place.size(), count = voxels + twins.size();
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(count, count);
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
    for (size_t t = 0; t < twins.size(); ++t) {
      const size_t i = voxels + t;
      matrix(i, i) = twins.inverse[t] > 0 ? 1.0 / twins.inverse[t] : 1.0;
      for (int32_t k = twins.first[t]; k < twins.first[t + 1]; ++k) {
        const Twins::Link& link = twins.links[k];
        const size_t j =
            link.to < 0 ? voxels + static_cast<size_t>(~link.to) : static_cast<size_t>(unknown[link.to]);
        matrix(i, j) = -link.g;
        matrix(j, i) = -link.g;
      }
    }
    factors.compute(matrix);
  }

  void solve(const Field<float>& b, Field<float>& x, Twins& twins) const {
    const size_t voxels = place.size();
    Eigen::VectorXd rhs(voxels + twins.size());
    for (size_t i = 0; i < voxels; ++i) rhs[i] = b[place[i]];
    for (size_t t = 0; t < twins.size(); ++t) rhs[voxels + t] = twins.b[t];
    const Eigen::VectorXd solution = factors.solve(rhs);
    x.fill(0);
    for (size_t i = 0; i < voxels; ++i) x[place[i]] = static_cast<float>(solution[i]);
    for (size_t t = 0; t < twins.size(); ++t) twins.x[t] = static_cast<float>(solution[voxels + t]);
  }
};

Multigrid::~Multigrid() = default;
Multigrid::Multigrid(Multigrid&&) noexcept = default;

Multigrid::Multigrid(std::shared_ptr<const Operator> finest, const CycleSettings& settings)
    : settings_(settings) {
  Wave wave(*finest->topology);
  levels_.push_back({std::move(finest), std::move(wave), {}, {}, {}, {}});
  const size_t most_twins = kFewTwins + levels_.front().unknowns() / kVoxelsPerTwin;
  std::shared_ptr<Operator> last;  // of the coarsest level so far; null: the finest, which has no twins
  while (true) {
    Level& fine = levels_.back();
    const size_t unknowns = fine.unknowns();
    Transfer transfer;
    Twins twins;
    std::shared_ptr<Operator> coarse;
    if (unknowns > settings_.direct_unknowns)
      coarse = std::make_shared<Operator>(coarsen(*fine.A, fine.twins, most_twins, transfer, twins));
    if (last) addLinks(fine.twins, *last);
    if (!coarse) {
      direct_ = std::make_unique<DirectSolver>(*fine.A, fine.twins);
      break;
    }
    // Pieces too far apart to merge leave one voxel each, which the smoother solves exactly.
    if (10 * (coarse->topology->activeVoxelCount() + twins.size()) > 9 * unknowns) break;
    fine.to_coarse = std::move(transfer);
    Field<float> x(*coarse->topology), b(*coarse->topology);
    Wave coarse_wave(*coarse->topology);
    levels_.push_back({coarse, std::move(coarse_wave), {}, std::move(twins), std::move(x), std::move(b)});
    last = std::move(coarse);
  }
}

/// From b to the solution of the next level.
void Multigrid::descend(size_t l, const Field<float>& b, Field<float>& x) {
  Level &level = levels_[l], &coarse = levels_[l + 1];
  Twins& twins = level.twins;
  twins.x.assign(twins.size(), 0.0f);
  downStroke(*level.A, level.wave, settings_.sweeps, b, x, level.to_coarse, coarse.b);
  relaxTwins(twins, x, false);
  restrictRows(*level.A, twins, b, x, level.to_coarse.apart, coarse.b, coarse.twins);
  cycle(l + 1);
}

/// Brings what the next level has found to rows that the blocks do not know; see prolongRows.
std::vector<float> Multigrid::prolongApart(size_t l, Field<float>& x) {
  const Level& coarse = levels_[l + 1];
  return prolongRows(levels_[l].to_coarse.apart, coarse.x, coarse.twins, x, levels_[l].twins);
}

void Multigrid::cycle(size_t l) {
  if (l + 1 == levels_.size()) return solveCoarsest(levels_[l].b, levels_[l].x);
  Level &level = levels_[l], &coarse = levels_[l + 1];
  descend(l, level.b, level.x);
  const std::vector<float> pending = prolongApart(l, level.x);
  relaxTwins(level.twins, level.x, true, &pending);
  const std::vector<float> before = addFromTwins(level.twins, level.b);
  upStroke(*level.A, level.wave, settings_.sweeps, level.to_coarse, *coarse.A->topology, coarse.x, level.b,
           level.x);
  putBack(level.twins, before, level.b);
}

void Multigrid::solveCoarsest(const Field<float>& b, Field<float>& x) {
  Level& level = levels_.back();
  Twins& twins = level.twins;
  if (direct_) return direct_->solve(b, x, twins);
  x.fill(0);
  twins.x.assign(twins.size(), 0.0f);
  for (const bool reverse : {false, true})
    for (int i = 0; i < settings_.coarsest_sweeps; ++i) {
      if (twins.size() == 0) {
        smooth(*level.A, level.wave, settings_.sweeps, reverse, b, x);
        continue;
      }
      if (reverse) relaxTwins(twins, x, true);
      const std::vector<float> before = addFromTwins(twins, level.b);  // which is b, as there are twins
      smooth(*level.A, level.wave, settings_.sweeps, reverse, level.b, x);
      putBack(twins, before, level.b);
      if (!reverse) relaxTwins(twins, x, false);
    }
}

void Multigrid::precondition(const Field<float>& r, Field<float>& z) {
  Level& level = levels_.front();
  if (levels_.size() == 1) return solveCoarsest(r, z);
  descend(0, r, z);
  prolongApart(0, z);
  upStroke(*level.A, level.wave, settings_.sweeps, level.to_coarse, *levels_[1].A->topology, levels_[1].x, r,
           z);
}

Products Multigrid::precondition(const Field<float>& r, Field<float>& z, Field<float>& Az) {
  Level& level = levels_.front();
  const Operator& A = *level.A;
  if (levels_.size() == 1) {
    solveCoarsest(r, z);
    const double zAz = apply(A, z, Az);
    return {dot(r, z), zAz};
  }
  descend(0, r, z);
  prolongApart(0, z);
  return upStroke(A, level.wave, settings_.sweeps, level.to_coarse, *levels_[1].A->topology, levels_[1].x, r,
                  z, Az);
}

size_t Multigrid::bytes() const {
  size_t bytes = 0;
  for (const Level& level : levels_) {
    const Operator& A = *level.A;
    for (const Field<float>* f : {&A.half_resistance, &A.faces[0], &A.faces[1], &A.faces[2], &A.sink,
                                  &A.inverse_diagonal, &level.x, &level.b, &level.to_coarse.spill})
      bytes += f->size() * sizeof(float);
    bytes += A.topology->bytes() + level.twins.bytes() + level.to_coarse.apart.bytes();
  }
  return bytes;
}

}  // namespace vdb_diffuse
