#include "multigrid/strokes.h"

#include "multigrid/block_transfer.h"

namespace vdb_diffuse {
namespace {

/// One level's system and what its blocks exchange with the next.
struct Stroke {
  const Operator& A;
  int sweeps;
  const Field<float>& b;
  Field<float>& x;
  const Transfer* transfer = nullptr;
  const Topology* coarse = nullptr;
};

VDB_DIFFUSE_INLINE void openBlock(const Operator& A, size_t block, BlockSystem& system) {
  system.braids = activeBraids(A.topology->active(block));
  loadFaces(A, block, system.braids, system.g);
}

VDB_DIFFUSE_INLINE void loadSystem(const Stroke& stroke, size_t block, BlockSystem& system) {
  loadValues(stroke.b.block(block), system.right);
  loadValues(stroke.A.inverse_diagonal.block(block), system.inverse);
}

VDB_DIFFUSE_INLINE void restrictTo(const Stroke& stroke, const BlockSystem& system, size_t block, int colours,
                                   Field<float>& coarse_b, float* spill) {
  const Topology& fine = *stroke.A.topology;
  CoarseSums sums;
  restrictBlock(system, rowBits(fine.active(block)), colours, sums);
  storeSums(sums, octantOf(fine.origin(block)), coarse_b.block(stroke.transfer->parent[block]),
            spill + block * kSpill);
}

VDB_DIFFUSE_INLINE void prolongFrom(const Stroke& stroke, const Field<float>& e, size_t block,
                                    BlockSystem& system) {
  const Topology& fine = *stroke.A.topology;
  CoarseHalo halo;
  loadCoarseHalo(*stroke.coarse, e, stroke.transfer->parent[block], octantOf(fine.origin(block)), halo);
  prolongBlock(halo, rowBits(fine.active(block)), system);
}

/// Blocks of colour 0 see nothing yet but themselves.
VDB_DIFFUSE_KERNEL void smoothFirst(const Stroke& stroke, size_t block) {
  BlockSystem system;
  openBlock(stroke.A, block, system);
  loadSystem(stroke, block, system);
  clear(system.u);
  relax(system, SweepOrder::kForward, stroke.sweeps);
  storeOwn(system.u, stroke.x.block(block));
}

/// Blocks of colour 1 find their neighbours as they stay, and can form their residual at once.
VDB_DIFFUSE_KERNEL void smoothAndRestrict(const Stroke& stroke, size_t block, Field<float>& coarse_b,
                                          float* spill) {
  BlockSystem system;
  openBlock(stroke.A, block, system);
  loadSystem(stroke, block, system);
  clearOwn(system.u);
  loadLayers(*stroke.A.topology, stroke.x, block, 0.0f, system.u);
  relax(system, SweepOrder::kForward, stroke.sweeps);
  storeOwn(system.u, stroke.x.block(block));
  loadValues(stroke.A.sink.block(block), system.sink);
  restrictTo(stroke, system, block, 1, coarse_b, spill);
}

VDB_DIFFUSE_KERNEL void restrictOnly(const Stroke& stroke, size_t block, Field<float>& coarse_b,
                                     float* spill) {
  BlockSystem system;
  openBlock(stroke.A, block, system);
  loadValues(stroke.b.block(block), system.right);
  loadValues(stroke.A.sink.block(block), system.sink);
  loadOwn(stroke.x.block(block), system.u);
  loadLayers(*stroke.A.topology, stroke.x, block, 0.0f, system.u);
  restrictTo(stroke, system, block, 2, coarse_b, spill);
}

VDB_DIFFUSE_KERNEL void gatherSpill(const Topology& fine, const Transfer& transfer, Field<float>& coarse_b,
                                    size_t block) {
  const Coord octant = octantOf(fine.origin(block));
  float* out = coarse_b.block(transfer.parent[block]);
  for (int face = 0; face < 6; ++face) {
    const int32_t near = fine.neighbours(block)[face];
    if (near == kNoBlock) continue;
    const float* spill = transfer.spill.data() + static_cast<size_t>(near) * kSpill + (face ^ 1) * 16;
    const int at = face % 2 ? 3 : 0;
    for (int j = 0; j < 4; ++j)
      for (int k = 0; k < 4; ++k) {
        const int x = face / 2 == 0 ? at : j,
                  y = face / 2 == 0   ? j
                      : face / 2 == 1 ? at
                                      : k,
                  z = face / 2 == 2 ? at : k;
        out[voxelOffset(octant[0] + x, octant[1] + y, octant[2] + z)] += spill[j * 4 + k];
      }
  }
}

VDB_DIFFUSE_KERNEL void prolongOnly(const Stroke& stroke, const Field<float>& e, size_t block) {
  BlockSystem system;
  openBlock(stroke.A, block, system);
  loadOwn(stroke.x.block(block), system.u);
  prolongFrom(stroke, e, block, system);
  storeOwn(system.u, stroke.x.block(block));
}

VDB_DIFFUSE_INLINE double dotRight(const BlockSystem& system) {
  DoubleRow dot{};
  forEachBraid(system.braids, [&](int n) VDB_DIFFUSE_INLINED {
    for (int s = 0; s < 2; ++s)
      dot += widen(loadRow(system.right.v[n][s])) * widen(loadRow(system.u.at(n, s)));
  });
  return sumOf(dot);
}

/// Stores A u and returns u.A u.
VDB_DIFFUSE_INLINE double applySystem(const BlockSystem& system, float* out) {
  DoubleRow dot{};
  for (int x = 0; x < 8; ++x)
    for (int q = 0; q < kBraids; ++q) {
      const int n = placeOf(x, q);
      Braid v = {};
      if (system.braids >> n & 1)
        for (int s = 0; s < 2; ++s) {
          v.strand[s] = applied(system, n, s);
          dot += widen(v.strand[s]) * widen(loadRow(system.u.at(n, s)));
        }
      storeBraid(out + braidOffset(x, q), v);
    }
  return sumOf(dot);
}

VDB_DIFFUSE_KERNEL double prolongAndSmooth(const Stroke& stroke, const Field<float>& e, size_t block) {
  BlockSystem system;
  openBlock(stroke.A, block, system);
  loadSystem(stroke, block, system);
  loadOwn(stroke.x.block(block), system.u);
  loadLayers(*stroke.A.topology, stroke.x, block, 0.0f, system.u);
  prolongFrom(stroke, e, block, system);
  relax(system, SweepOrder::kBackward, stroke.sweeps);
  storeOwn(system.u, stroke.x.block(block));
  return dotRight(system);
}

VDB_DIFFUSE_KERNEL Products smoothAgain(const Stroke& stroke, SweepOrder order, size_t block, float* Ax) {
  BlockSystem system;
  openBlock(stroke.A, block, system);
  loadSystem(stroke, block, system);
  loadOwn(stroke.x.block(block), system.u);
  loadLayers(*stroke.A.topology, stroke.x, block, 0.0f, system.u);
  relax(system, order, stroke.sweeps);
  storeOwn(system.u, stroke.x.block(block));
  if (!Ax) return {};
  loadValues(stroke.A.sink.block(block), system.sink);
  return {dotRight(system), applySystem(system, Ax)};
}

VDB_DIFFUSE_KERNEL double applyTo(const Operator& A, const Field<float>& p, size_t block, float* q) {
  BlockSystem system;
  openBlock(A, block, system);
  loadValues(A.sink.block(block), system.sink);
  loadOwn(p.block(block), system.u);
  loadLayers(*A.topology, p, block, 0.0f, system.u);
  return applySystem(system, q);
}

void ascend(const Stroke& stroke, Wave& wave, const Field<float>& e, Field<float>* Ax, Products* products) {
  wave.run(Ax ? 4 : 3, [&](int stage, size_t block) {
    if (stage == 0) prolongOnly(stroke, e, block);
    if (stage == 1) {
      const double dot = prolongAndSmooth(stroke, e, block);
      if (products) products[block].bx = dot;
    }
    if (stage == 2) {
      const Products both =
          smoothAgain(stroke, SweepOrder::kBackward, block, Ax ? Ax->block(block) : nullptr);
      if (products) products[block] = both;
    }
    if (stage == 3) products[block].xAx = applyTo(stroke.A, stroke.x, block, Ax->block(block));
  });
}

}  // namespace

void downStroke(const Operator& A, Wave& wave, int sweeps, const Field<float>& b, Field<float>& x,
                Transfer& transfer, Field<float>& coarse_b) {
  const Stroke stroke{A, sweeps, b, x, &transfer};
  float* spill = transfer.spill.data();
  wave.run(3, [&](int stage, size_t block) {
    if (stage == 0) smoothFirst(stroke, block);
    if (stage == 1) smoothAndRestrict(stroke, block, coarse_b, spill);
    if (stage == 2) restrictOnly(stroke, block, coarse_b, spill);
  });
  forEachBlock(transfer.parent.size(),
               [&](size_t block) { gatherSpill(*A.topology, transfer, coarse_b, block); });
}

void upStroke(const Operator& A, Wave& wave, int sweeps, const Transfer& transfer, const Topology& coarse,
              const Field<float>& e, const Field<float>& b, Field<float>& x) {
  ascend({A, sweeps, b, x, &transfer, &coarse}, wave, e, nullptr, nullptr);
}

Products upStroke(const Operator& A, Wave& wave, int sweeps, const Transfer& transfer, const Topology& coarse,
                  const Field<float>& e, const Field<float>& b, Field<float>& x, Field<float>& Ax) {
  std::vector<Products> products(A.topology->blockCount());
  ascend({A, sweeps, b, x, &transfer, &coarse}, wave, e, &Ax, products.data());
  return sumOverBlocks<Products>(products.size(), [&](size_t block) { return products[block]; });
}

void smooth(const Operator& A, Wave& wave, int sweeps, bool reverse, const Field<float>& b, Field<float>& x) {
  const Stroke stroke{A, sweeps, b, x};
  if (!reverse)
    wave.run(2, [&](int, size_t block) { smoothAgain(stroke, SweepOrder::kForward, block, nullptr); });
  else
    wave.run(3, [&](int stage, size_t block) {
      if (stage > 0) smoothAgain(stroke, SweepOrder::kBackward, block, nullptr);
    });
}

}  // namespace vdb_diffuse
