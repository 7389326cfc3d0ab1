#include "vdb/metadata_check.h"

#include <algorithm>
#include <map>

#include "vdb/value_chunk.h"

namespace vdb_diffuse {
namespace {

/// Types of metadata with one size, bytes.
const std::map<std::string, uint32_t> kTypeSizes = {
    {"bool", 1},    {"int32", 4},   {"int64", 8},   {"float", 4},       {"double", 8},
    {"vec2i", 8},   {"vec2s", 8},   {"vec2d", 16},  {"vec3i", 12},      {"vec3s", 12},
    {"vec3d", 24},  {"vec4i", 16},  {"vec4s", 16},  {"vec4d", 32},      {"mat4s", 64},
    {"mat4d", 128}, {"ptidx32", 4}, {"ptidx64", 8}, {"ptdataidx32", 4}, {"ptdataidx64", 8}};

/// Metadata that OpenVDB sets itself, and fails to where they are there with another type.
const std::map<std::string, std::string> kReservedTypes = {{"class", "string"},
                                                           {"file_compression", "string"},
                                                           {"is_saved_as_half_float", "bool"},
                                                           {"is_local_space", "bool"},
                                                           {"name", "string"},
                                                           {"vector_type", "string"}};

/// Maps from index to world space, and the bytes that each stores.
const std::map<std::string, uint32_t> kLinearMapSizes = {{"AffineMap", 128},
                                                         {"UnitaryMap", 128},
                                                         {"ScaleMap", 120},
                                                         {"UniformScaleMap", 120},
                                                         {"TranslationMap", 24},
                                                         {"ScaleTranslateMap", 144},
                                                         {"UniformScaleTranslateMap", 144}};
constexpr uint32_t kFrustumSize = 64;  // a box, taper and depth; then another map

/// One of the two lists in the metadata for delayed loading: a length in 32 bits and so many bytes of blosc,
/// or 0 and plain values. Small lists are packed with padding.
void checkDelayedLoadList(ByteReader& in, uint32_t packed, uint64_t bytes) {
  constexpr uint64_t kPadded = 128;
  if (packed == 0) {
    in.skip(bytes);
    return;
  }
  const uint64_t unpacked = bloscSize(in.take(packed), packed);
  if (unpacked != bytes && !(unpacked == kPadded && bytes <= kPadded))
    in.failDamaged("its list for delayed loading does not unpack to " + std::to_string(bytes) + " bytes");
}

void checkDelayedLoad(ByteReader& in, uint32_t size) {
  if (size == 0) return;
  const uint64_t end = in.position() + size;
  const uint32_t leaves = in.read<uint32_t>();
  constexpr uint64_t kBytesPerLeaf = 128;  // at the least: two masks
  if (leaves > in.size() / kBytesPerLeaf)
    in.failDamaged("a list for delayed loading of " + std::to_string(leaves) + " leaves");
  checkDelayedLoadList(in, in.read<uint32_t>(), leaves);
  const uint32_t packed = in.read<uint32_t>();
  if (packed != UINT32_MAX) checkDelayedLoadList(in, packed, uint64_t(8) * leaves);
  if (in.position() > end) in.failDamaged("its lists for delayed loading are longer than they say");
  in.seek(end);
}

}  // namespace

StoredMetadata checkMetadata(ByteReader& in) {
  StoredMetadata result;
  const uint32_t count =
      in.read<uint32_t>();  // each takes at least 12 bytes, so a wrong one ends with the file
  for (uint32_t m = 0; m < count; ++m) {
    const std::string name = in.readText(), type = in.readText();
    const uint32_t size = in.read<uint32_t>();
    const auto known = kTypeSizes.find(type);
    const auto reserved = kReservedTypes.find(name);
    if (name.empty()) in.failDamaged("metadata without a name");
    if (known != kTypeSizes.end() && known->second != size)
      in.failDamaged("metadata " + name + " of type " + type + " with " + std::to_string(size) + " bytes");
    if (reserved != kReservedTypes.end() && reserved->second != type)
      in.failDamaged("metadata " + name + " of type " + type);
    if (type == "bool") {
      const bool value = in.readBool();
      if (name == "is_saved_as_half_float") result.half = value;
    } else if (type == "__delayedload") {
      if (size > in.remaining()) in.skip(size);  // says how much is missing
      checkDelayedLoad(in, size);
    } else {
      in.skip(size);
    }
  }
  return result;
}

void checkTransform(ByteReader& in) {
  std::string type = in.readText();
  if (type == "NonlinearFrustumMap") {  // holds a linear one; one that holds its like could go on for long
    in.skip(kFrustumSize);
    type = in.readText();
  }
  const auto known = kLinearMapSizes.find(type);
  if (known == kLinearMapSizes.end()) in.failDamaged("its transform is of unknown type '" + type + "'");
  in.skip(known->second);
}

}  // namespace vdb_diffuse
