#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cstddef>
#include <vector>

namespace vdb_diffuse {

constexpr size_t kBlockGrain = 8;  ///< blocks a thread takes at a time: some microseconds of work

/// body(block) for every block, in parallel, in no order.
template <typename Body>
void forEachBlock(size_t block_count, const Body& body, size_t grain = kBlockGrain) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, block_count, grain), [&](const auto& range) {
    for (size_t b = range.begin(); b != range.end(); ++b) body(b);
  });
}

/// Sum of term(block), a Sum with `+=`, over all blocks. Parts are added in the order of the blocks, so the
/// result does not depend on the number of threads, to the bit.
template <typename Sum, typename Term>
Sum sumOverBlocks(size_t block_count, const Term& term, size_t grain = kBlockGrain) {
  constexpr size_t kPart = 64;  // blocks in one part: fixed, as the rounding depends on it
  const size_t parts = (block_count + kPart - 1) / kPart;
  std::vector<Sum> part(parts, Sum());
  const size_t parts_grain = grain > kPart ? grain / kPart : 1;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, parts, parts_grain), [&](const auto& range) {
    for (size_t p = range.begin(); p != range.end(); ++p) {
      const size_t end = (p + 1) * kPart < block_count ? (p + 1) * kPart : block_count;
      for (size_t b = p * kPart; b < end; ++b) part[p] += term(b);
    }
  });
  Sum sum = Sum();
  for (const Sum& s : part) sum += s;
  return sum;
}

}  // namespace vdb_diffuse
