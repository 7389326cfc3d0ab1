#include "grid/aligned.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace vdb_diffuse {
namespace {

#if !defined(__SANITIZE_ADDRESS__)

constexpr size_t kMega = size_t{1} << 20;

TEST(KeepArrays, AnArrayGivenBackServesTheNextOfItsSize) {
  const KeepArrays keeper;
  AlignedArray<char> first = alignedArray<char>(kMega);
  const void* place = first.get();
  first.reset();
  EXPECT_EQ(KeepArrays::kept(), kMega);
  const AlignedArray<char> next = alignedArray<char>(kMega);
  EXPECT_EQ(next.get(), place);
  EXPECT_EQ(KeepArrays::kept(), 0u);
}

TEST(KeepArrays, AllTogetherTakeNoMoreThanWasInUseAtOnce) {
  const KeepArrays keeper;
  AlignedArray<char> a = alignedArray<char>(2 * kMega), b = alignedArray<char>(3 * kMega);
  a.reset();
  b.reset();
  EXPECT_EQ(KeepArrays::kept(), 5 * kMega);
  const AlignedArray<char> c = alignedArray<char>(kMega);  // makes the largest that waits give way
  EXPECT_EQ(KeepArrays::kept(), 2 * kMega);
  const AlignedArray<char> d = alignedArray<char>(4 * kMega);
  EXPECT_EQ(KeepArrays::kept(), 0u);
}

TEST(KeepArrays, NothingIsKeptOutsideTheirLives) {
  {
    const KeepArrays outer;
    {
      const KeepArrays inner;
      alignedArray<char>(kMega).reset();
    }
    EXPECT_EQ(KeepArrays::kept(), kMega);
  }
  EXPECT_EQ(KeepArrays::kept(), 0u);
  alignedArray<char>(kMega).reset();
  EXPECT_EQ(KeepArrays::kept(), 0u);
}

#endif

TEST(AlignedArray, BeginsOnACacheLine) {
  for (const size_t count : {size_t{1}, size_t{1000}, size_t{1} << 20, size_t{3} << 20}) {
    const AlignedArray<float> array = alignedArray<float>(count);
    EXPECT_EQ(reinterpret_cast<uintptr_t>(array.get()) % 64, 0u) << count;
  }
  EXPECT_EQ(alignedArray<float>(0).get(), nullptr);
}

}  // namespace
}  // namespace vdb_diffuse
