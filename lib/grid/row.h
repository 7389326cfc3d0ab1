#pragma once

#include <cstdint>

#include "grid/topology.h"

// Eight voxels side by side along a block's contiguous axis, the unit that kernels work on.

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
/// Compiled for AVX2 as well and chosen when the program starts. The conductances are formed by one addition
/// and one division, so they are the same numbers on either path.
#define VDB_DIFFUSE_KERNEL __attribute__((target_clones("arch=x86-64-v3", "default")))
#else  // ThreadSanitizer, for one, would watch what chooses before it has started itself
#define VDB_DIFFUSE_KERNEL
#endif
#define VDB_DIFFUSE_INLINE inline __attribute__((always_inline))
/// Between a lambda's parameters and its body: one that stays a function of its own is compiled without AVX2.
#define VDB_DIFFUSE_INLINED __attribute__((always_inline))

namespace vdb_diffuse {

/// The eight voxels of a row along z, as one vector register where the processor has it.
using Row = float __attribute__((vector_size(32)));
using RowMask = int __attribute__((vector_size(32)));  ///< per voxel all bits or none
VDB_DIFFUSE_INLINE Row loadRow(const float* p) {
  Row row;
  __builtin_memcpy(&row, p, sizeof row);
  return row;
}
VDB_DIFFUSE_INLINE void storeRow(float* p, Row row) {
  __builtin_memcpy(p, &row, sizeof row);
}

/// Which voxels of each row along z are active, a byte a row.
VDB_DIFFUSE_INLINE const uint8_t* rowBits(const BlockMask& mask) {
  static_assert(sizeof(BlockMask) == kBlockVoxels / 8, "OpenVDB's NodeMask holds nothing but its words");
  return reinterpret_cast<const uint8_t*>(&mask);
}
VDB_DIFFUSE_INLINE RowMask rowMask(uint8_t bits) {
  constexpr RowMask kBits = {1, 2, 4, 8, 16, 32, 64, 128};
  return (kBits & bits) != 0;
}

VDB_DIFFUSE_INLINE bool anyOf(RowMask mask) {
  uint64_t words[4];
  __builtin_memcpy(words, &mask, sizeof words);
  return (words[0] | words[1] | words[2] | words[3]) != 0;
}

/// Sums are kept in double, eight side by side and then in a fixed order. Two registers of four: the compiler
/// takes a vector wider than its registers through memory.
struct DoubleRow {
  using Half = double __attribute__((vector_size(32)));
  Half low, high;
};
VDB_DIFFUSE_INLINE DoubleRow widen(Row row) {
  using FourFloats = float __attribute__((vector_size(16)));
  FourFloats half[2];
  __builtin_memcpy(half, &row, sizeof row);
  return {__builtin_convertvector(half[0], DoubleRow::Half),
          __builtin_convertvector(half[1], DoubleRow::Half)};
}
VDB_DIFFUSE_INLINE DoubleRow loadDoubles(const double* p) {
  DoubleRow row;
  __builtin_memcpy(&row, p, sizeof row);
  return row;
}
VDB_DIFFUSE_INLINE void storeDoubles(double* p, const DoubleRow& row) {
  __builtin_memcpy(p, &row, sizeof row);
}
VDB_DIFFUSE_INLINE DoubleRow operator*(const DoubleRow& a, const DoubleRow& b) {
  return {a.low * b.low, a.high * b.high};
}
VDB_DIFFUSE_INLINE DoubleRow operator*(double a, const DoubleRow& b) {
  return {a * b.low, a * b.high};
}
VDB_DIFFUSE_INLINE void operator+=(DoubleRow& a, const DoubleRow& b) {
  a.low += b.low;
  a.high += b.high;
}
VDB_DIFFUSE_INLINE double sumOf(const DoubleRow& v) {
  return ((v.low[0] + v.low[1]) + (v.low[2] + v.low[3])) +
         ((v.high[0] + v.high[1]) + (v.high[2] + v.high[3]));
}

}  // namespace vdb_diffuse
