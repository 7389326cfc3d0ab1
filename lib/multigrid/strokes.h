#pragma once

#include "multigrid/transfer.h"
#include "multigrid/wave.h"

namespace vdb_diffuse {

// The two halves of a V-cycle on one level, each in one pass over memory. Smoothing is Gauss-Seidel in two
// colours of blocks (a checkerboard of 8^3 blocks, whose faces touch only the other colour), and within a
// block in two colours of voxels, `sweeps` times while the block is in cache. The up-stroke smooths in the
// reverse order, which is the adjoint in the energy of A, so that a cycle is a symmetric preconditioner.
// Results do not depend on the number of threads.

/// Smooths A x = b from x = 0, which need not be initialised; then coarse b = P^T (b - A x).
void downStroke(const Operator& A, Wave& wave, int sweeps, const Field<float>& b, Field<float>& x,
                Transfer& transfer, Field<float>& coarse_b);

/// x += P e, then smooths A x = b in reverse.
void upStroke(const Operator& A, Wave& wave, int sweeps, const Transfer& transfer, const Topology& coarse,
              const Field<float>& e, const Field<float>& b, Field<float>& x);

/// b.x and x.A x, summed in a fixed order.
struct Products {
  double bx = 0, xAx = 0;
  void operator+=(const Products& o) {
    bx += o.bx;
    xAx += o.xAx;
  }
};

/// The same, and Ax = A x while it is at hand.
Products upStroke(const Operator& A, Wave& wave, int sweeps, const Transfer& transfer, const Topology& coarse,
                  const Field<float>& e, const Field<float>& b, Field<float>& x, Field<float>& Ax);

/// Smooths A x = b from the x that is there, forward or in reverse.
void smooth(const Operator& A, Wave& wave, int sweeps, bool reverse, const Field<float>& b, Field<float>& x);

}  // namespace vdb_diffuse
