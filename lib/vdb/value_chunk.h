#pragma once

#include "vdb/byte_reader.h"

namespace vdb_diffuse {

/// What a grid's compression flags say; the values are the file format's.
enum CompressionFlag : uint32_t { kZip = 1, kActiveValues = 2, kBlosc = 4, kEveryCompression = 7 };

/// Steps over `bytes` of values as one node stores them: plain, or a length in 64 bits and so many bytes of
/// zip or blosc, where a negative length means plain bytes after all. OpenVDB reads what the length says into
/// a buffer of `bytes` before it compares the two, so they must agree; a blosc chunk must hold a header that
/// says the same, and a zip chunk is unpacked, as only that shows how long it is.
class ValueChunks {
 public:
  ValueChunks(ByteReader& in, uint32_t compression) : in_(in), compression_(compression) {}
  void pass(uint64_t bytes);

 private:
  ByteReader& in_;
  uint32_t compression_;
  std::vector<unsigned char> unpacked_;

  void passBlosc(uint64_t packed, uint64_t bytes);
  void passZip(uint64_t packed, uint64_t bytes);
};

/// Bytes that a blosc chunk of `packed` bytes unpacks to, or 2^64 - 1 where it is not safe to try.
uint64_t bloscSize(const char* chunk, uint64_t packed);

}  // namespace vdb_diffuse
