#pragma once

#include <memory>
#include <vector>

#include "multigrid/strokes.h"

namespace vdb_diffuse {

struct CycleSettings {
  int sweeps = 2;                ///< Gauss-Seidel sweeps in each block before and after the coarse correction
  size_t direct_unknowns = 400;  ///< a level with at most so many unknowns is solved directly
  int coarsest_sweeps = 20;      ///< on the last level, where it is too large for that
};

/// A geometric multigrid hierarchy over the blocks of a sparse grid; one symmetric V-cycle of it is the
/// preconditioner. Trottenberg, Oosterlee and Schueller (2001), sections 2.4 and 7.8.
class Multigrid {
 public:
  /// \param finest  with its `inverse_diagonal`
  explicit Multigrid(std::shared_ptr<const Operator> finest, const CycleSettings& settings = {});
  ~Multigrid();
  Multigrid(Multigrid&&) noexcept;

  const Operator& finest() const { return *levels_.front().A; }
  /// Takes another operator for the finest level, of the same topology and not very different; the coarser
  /// levels stay those of the first.
  void exchangeFinest(std::shared_ptr<const Operator> finest) { levels_.front().A = std::move(finest); }
  /// z = V(r), one V-cycle for A z = r from z = 0.
  void precondition(const Field<float>& r, Field<float>& z);
  /// The same, and Az = A z; returns r.z and z.A z.
  Products precondition(const Field<float>& r, Field<float>& z, Field<float>& Az);
  size_t levelCount() const { return levels_.size(); }
  const Operator& level(size_t l) const { return *levels_[l].A; }
  size_t bytes() const;

 private:
  struct Level {
    std::shared_ptr<const Operator> A;
    Wave wave;
    Transfer to_coarse;
    Twins twins;
    Field<float> x, b;  // not on the finest level, whose caller brings them

    size_t unknowns() const { return A->topology->activeVoxelCount() + twins.size(); }
  };
  struct DirectSolver;

  CycleSettings settings_;
  std::vector<Level> levels_;
  std::unique_ptr<DirectSolver> direct_;

  void cycle(size_t l);
  void descend(size_t l, const Field<float>& b, Field<float>& x);
  std::vector<float> prolongApart(size_t l, Field<float>& x);
  void solveCoarsest(const Field<float>& b, Field<float>& x);
};

}  // namespace vdb_diffuse
