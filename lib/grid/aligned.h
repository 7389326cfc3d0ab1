#pragma once

#include <cstddef>
#include <memory>

namespace vdb_diffuse {

struct GiveArrayBack {
  size_t bytes = 0;
  void operator()(void* p) const;
};
template <typename T>
using AlignedArray = std::unique_ptr<T[], GiveArrayBack>;

/// Memory for `bytes`, a multiple of 64, on a cache line's boundary. \throws std::bad_alloc
void* takeArray(size_t bytes);

/// `count` uninitialised values on a cache line's boundary. Throws std::bad_alloc.
template <typename T>
AlignedArray<T> alignedArray(size_t count) {
  constexpr size_t kCacheLine = 64;
  const size_t bytes = (count * sizeof(T) + kCacheLine - 1) / kCacheLine * kCacheLine;
  if (bytes == 0) return nullptr;
  return AlignedArray<T>(static_cast<T*>(takeArray(bytes)), GiveArrayBack{bytes});
}

/// While one of these lives, arrays that are given back are kept for the next of their size, as long as all
/// together take no more than was once in use at the same time: a system that brings in fresh pages must
/// clear each, which costs more than most kernels do with them.
class KeepArrays {
 public:
  KeepArrays();
  ~KeepArrays();
  KeepArrays(const KeepArrays&) = delete;
  KeepArrays& operator=(const KeepArrays&) = delete;
  /// Bytes that wait to be used again.
  static size_t kept();
};

}  // namespace vdb_diffuse
