#pragma once

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

/// `count` uninitialised values on a cache line's boundary. Throws std::bad_alloc.
template <typename T>
AlignedArray<T> alignedArray(size_t count) {
  constexpr size_t kCacheLine = 64;
  const size_t bytes = (count * sizeof(T) + kCacheLine - 1) / kCacheLine * kCacheLine;
  if (bytes == 0) return nullptr;
  void* p = std::aligned_alloc(kCacheLine, bytes);
  if (!p) throw std::bad_alloc();
  return AlignedArray<T>(static_cast<T*>(p));
}

}  // namespace vdb_diffuse
