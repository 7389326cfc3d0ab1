#include "medium/turned_block.h"

namespace vdb_diffuse {
namespace {

/// Eight rows of eight become eight columns, by interleaving them three times.
VDB_DIFFUSE_INLINE void transpose(Row rows[8]) {
  constexpr RowMask kLow = {0, 8, 1, 9, 2, 10, 3, 11}, kHigh = {4, 12, 5, 13, 6, 14, 7, 15};
  for (int pass = 0; pass < 3; ++pass) {
    Row woven[8];
    for (int i = 0; i < 4; ++i) {
      woven[2 * i] = __builtin_shuffle(rows[i], rows[i + 4], kLow);
      woven[2 * i + 1] = __builtin_shuffle(rows[i], rows[i + 4], kHigh);
    }
    for (int i = 0; i < 8; ++i) rows[i] = woven[i];
  }
}

/// store(at, row) for the rows [z][x] of a block with the rows [x][y]; turning back is the same between the
/// strides.
template <typename Store>
VDB_DIFFUSE_INLINE void turn(const float* from, int stride_in, int stride_out, int slice_in, int slice_out,
                             const Store& store) {
  for (int x = 0; x < 8; ++x) {
    Row rows[8];
    for (int i = 0; i < 8; ++i) rows[i] = loadRow(from + x * slice_in + i * stride_in);
    transpose(rows);
    for (int i = 0; i < 8; ++i) store(x * slice_out + i * stride_out, rows[i]);
  }
}

}  // namespace

VDB_DIFFUSE_KERNEL void turnBlock(const float* from, float* to) {
  turn(from, 8, 64, 64, 8, [&](int at, Row row) { storeRow(to + at, row); });
}

VDB_DIFFUSE_KERNEL void turnBack(const float* from, float* to) {
  turn(from, 64, 8, 8, 64, [&](int at, Row row) { storeRow(to + at, row); });
}

VDB_DIFFUSE_KERNEL void addTurnedBack(const float* from, float* to) {
  turn(from, 64, 8, 8, 64, [&](int at, Row row) { storeRow(to + at, loadRow(to + at) + row); });
}

RowBits::RowBits(const BlockMask& mask) {
  std::copy_n(rowBits(mask), 64, plain);
  for (int x = 0; x < 8; ++x) {
    // 8 x 8 bits, turned by exchanging squares of 1, 2 and 4 on both sides of the diagonal (Warren, 7-3)
    uint64_t bits = mask.getWord<uint64_t>(static_cast<openvdb::Index>(x));
    const auto exchange = [&](int by, uint64_t squares) {
      const uint64_t t = (bits ^ bits >> by) & squares;
      bits ^= t ^ t << by;
    };
    exchange(7, 0x00AA00AA00AA00AAu);
    exchange(14, 0x0000CCCC0000CCCCu);
    exchange(28, 0x00000000F0F0F0F0u);
    for (int z = 0; z < 8; ++z) turned[z * 8 + x] = static_cast<uint8_t>(bits >> 8 * z);
  }
}

}  // namespace vdb_diffuse
