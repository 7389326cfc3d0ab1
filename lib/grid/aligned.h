#pragma once

#if defined(__linux__)
#include <sys/mman.h>
#endif

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>

namespace vdb_diffuse {

struct FreeMemory {
  void operator()(void* p) const { std::free(p); }
};
template <typename T>
using AlignedArray = std::unique_ptr<T[], FreeMemory>;

/// `count` uninitialised values on a cache line's boundary. Throws std::bad_alloc. Large arrays ask for huge
/// pages, as far as they fill them, as a kernel takes a block from each of a dozen arrays in turn: `bake` of 2
/// M voxels, diffusion alone, one thread, takes 0.95 of the time that it does without.
template <typename T>
AlignedArray<T> alignedArray(size_t count) {
  constexpr size_t kCacheLine = 64, kHugePage = size_t{2} << 20;
  const size_t bytes = (count * sizeof(T) + kCacheLine - 1) / kCacheLine * kCacheLine;
  if (bytes == 0) return nullptr;
  const bool large = bytes >= 2 * kHugePage;
  void* p = std::aligned_alloc(large ? kHugePage : kCacheLine, bytes);
  if (!p) throw std::bad_alloc();
#if defined(__linux__)
  if (large) ::madvise(p, bytes / kHugePage * kHugePage, MADV_HUGEPAGE);
#endif
  return AlignedArray<T>(static_cast<T*>(p));
}

}  // namespace vdb_diffuse
