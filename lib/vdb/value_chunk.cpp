#include "vdb/value_chunk.h"

#include <blosc.h>
#include <zlib.h>

#include <string>

namespace vdb_diffuse {

uint64_t bloscSize(const char* chunk, uint64_t packed) {
  size_t bytes = 0;
  if (packed < BLOSC_MIN_HEADER_LENGTH || blosc_cbuffer_validate(chunk, packed, &bytes) != 0)
    return UINT64_MAX;
  return bytes;
}

void ValueChunks::pass(uint64_t bytes) {
  if (!(compression_ & (kBlosc | kZip))) {
    in_.skip(bytes);
    return;
  }
  const int64_t length = in_.read<int64_t>();
  if (length <= 0) {
    if (length != -static_cast<int64_t>(bytes))
      in_.failDamaged("a node's values take " + std::to_string(bytes) + " bytes, and it stores " +
                      std::to_string(length));
    in_.skip(bytes);
  } else if (compression_ & kBlosc) {
    passBlosc(static_cast<uint64_t>(length), bytes);
  } else {
    passZip(static_cast<uint64_t>(length), bytes);
  }
}

void ValueChunks::passBlosc(uint64_t packed, uint64_t bytes) {
  if (packed > bytes + BLOSC_MAX_OVERHEAD)
    in_.failDamaged("a blosc chunk of " + std::to_string(packed) + " bytes for " + std::to_string(bytes));
  if (bloscSize(in_.take(packed), packed) != bytes)
    in_.failDamaged("a blosc chunk that does not hold the " + std::to_string(bytes) +
                    " bytes of its node's values");
}

void ValueChunks::passZip(uint64_t packed, uint64_t bytes) {
  if (packed > compressBound(bytes))
    in_.failDamaged("a zip chunk of " + std::to_string(packed) + " bytes for " + std::to_string(bytes));
  unpacked_.resize(bytes + 1);  // never empty
  uLongf got = bytes;
  const auto* chunk = reinterpret_cast<const unsigned char*>(in_.take(packed));
  if (uncompress(unpacked_.data(), &got, chunk, packed) != Z_OK || got != bytes)
    in_.failDamaged("a zip chunk that does not hold the " + std::to_string(bytes) +
                    " bytes of its node's values");
}

}  // namespace vdb_diffuse
