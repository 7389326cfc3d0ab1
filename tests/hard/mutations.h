#pragma once

#include <cstdint>
#include <string>

namespace vdb_diffuse {

/// Bytes damaged in one to three places as the seed says: bits, bytes, fields and counts changed, pieces
/// cut out, doubled or overwritten, the end cut off. Half of the damage lies in the first 2000 bytes.
std::string mutatedBytes(uint64_t seed, std::string bytes);

/// Likewise for text: numbers, words and quoted strings exchanged for telling ones, lines doubled, lost or
/// moved, brackets opened; now and then bytes as above.
std::string mutatedText(uint64_t seed, std::string text);

}  // namespace vdb_diffuse
